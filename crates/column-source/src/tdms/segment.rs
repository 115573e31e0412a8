//! Segments: what is new about groups and channels, and the values behind it.

use std::collections::{BTreeMap, HashMap};

use super::bytes::{Bytes, Fault};
use super::index::{self, Index, Written};
use super::values::{self, Kind, Raw};

/// What a segment has.
const METADATA: u32 = 1 << 1;
const RAW_DATA: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const NEW_LIST: u32 = 1 << 2;
/// How long a segment is that nobody could finish.
const UNFINISHED: u64 = u64::MAX;
/// No recorder has more channels.
const MOST_CHANNELS: usize = 20_000;

/// Properties by name.
pub(super) type Properties = BTreeMap<String, Property>;

/// The value of a property.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Property {
    Number(f64),
    Text(String),
    /// Since 1904, and the part of a second in 2^-64 s.
    Time(i64, u64),
}

/// A channel.
#[derive(Debug)]
pub(super) struct Channel {
    pub group: String,
    pub name: String,
    /// Its place among all channels of the file.
    pub place: usize,
    pub properties: Properties,
    pub raw: Raw,
    index: Option<Index>,
}

/// A whole file.
#[derive(Debug, Default)]
pub(super) struct Content {
    /// Groups with channels, as they appear.
    pub groups: Vec<String>,
    pub channels: Vec<Channel>,
    /// Properties of the file under "", of a group under its name with a slash before it.
    others: HashMap<String, Properties>,
    /// Whether the file ends within a row.
    pub cut: bool,
    places: HashMap<(String, String), usize>,
    /// Channels of the segment at hand with the index that they have there.
    list: Vec<(usize, Option<Index>)>,
    /// Those of them that have values.
    active: Vec<(usize, Index)>,
}

impl Property {
    pub fn number(&self) -> Option<f64> {
        if let Self::Number(number) = self { Some(*number) } else { None }
    }

    pub fn text(&self) -> Option<&str> {
        if let Self::Text(text) = self { Some(text) } else { None }
    }

    /// A time as seconds since 1904.
    pub fn seconds(&self) -> Option<f64> {
        if let Self::Time(seconds, fraction) = self {
            return Some(*seconds as f64 + *fraction as f64 / 2_f64.powi(64));
        }
        None
    }

    fn read(bytes: &mut Bytes<'_>, name: &str) -> Result<Self, Fault> {
        let code = bytes.u32()?;
        let unknown = || Fault::Broken(format!("the property \"{name}\" has the type {code:#x}, which none has"));
        let kind = Kind::of(code).ok_or_else(unknown)?;
        if kind == Kind::Text {
            return bytes.text().map(Self::Text);
        }
        let (value, big) = (bytes.take(kind.size())?, bytes.big);
        Ok(match (kind, values::time(value, big)) {
            (Kind::Time, Some((seconds, fraction))) => Self::Time(seconds, fraction),
            _ => Self::Number(kind.number(value, big)),
        })
    }
}

/// Reads a file.
pub(super) fn read(bytes: &[u8]) -> Result<Content, Fault> {
    let mut content = Content::default();
    let mut rest = bytes;
    while !rest.is_empty() {
        rest = content.segment(rest)?;
    }
    Ok(content)
}

impl Content {
    /// The properties of a channel's group and of the file.
    pub fn properties_above(&self, group: &str) -> Vec<&Properties> {
        [format!("/{group}"), String::new()].iter().filter_map(|key| self.others.get(key)).collect()
    }

    /// Reads the segment that bytes begin with, and gives what follows it.
    fn segment<'a>(&mut self, bytes: &'a [u8]) -> Result<&'a [u8], Fault> {
        let mut lead = Bytes { rest: bytes, big: false };
        if lead.take(4)? != b"TDSm" {
            return Err(Fault::Broken("no segment begins where one should".to_owned()));
        }
        let flags = lead.u32()?;
        lead.big = flags & BIG_ENDIAN != 0;
        let _version = lead.u32()?;
        let (length, raw_at) = (lead.u64()?, lead.u64()?);
        let unfinished = length == UNFINISHED;
        let body = if unfinished { lead.take(lead.rest.len() as u64)? } else { lead.take(length)? };
        let mut metadata = Bytes { rest: body, big: lead.big };
        let too_long = |_| Fault::Broken("what a segment says of its channels is longer than the segment".to_owned());
        metadata.rest = metadata.take(raw_at).map_err(too_long)?;
        if flags & METADATA != 0 {
            self.metadata(&mut metadata, flags & NEW_LIST != 0)?;
        }
        if flags & RAW_DATA != 0 {
            let raw = Bytes { rest: &body[usize::try_from(raw_at).unwrap_or(body.len())..], big: lead.big };
            self.raw(raw, flags & INTERLEAVED != 0, unfinished)?;
        }
        Ok(lead.rest)
    }

    /// Reads what is new about groups and channels.
    fn metadata(&mut self, bytes: &mut Bytes<'_>, new_list: bool) -> Result<(), Fault> {
        if new_list {
            self.list.clear();
        }
        for _ in 0..bytes.u32()? {
            let path = bytes.text()?;
            let written = index::read(bytes, &path)?;
            let mut properties = Properties::new();
            for _ in 0..bytes.u32()? {
                let name = bytes.text()?;
                let value = Property::read(bytes, &name)?;
                properties.insert(name, value);
            }
            match &names(&path)[..] {
                [] => self.others.entry(String::new()).or_default().extend(properties),
                [group] => self.others.entry(format!("/{group}")).or_default().extend(properties),
                [group, name] => {
                    let place = self.channel(group, name)?;
                    self.channels[place].properties.extend(properties);
                    self.indexed(place, written, &path)?;
                }
                _ => return Err(Fault::Broken(format!("{path} is neither a group nor a channel"))),
            }
        }
        let with_values = |(place, index): &(usize, Option<Index>)| Some((*place, index.filter(|one| one.count > 0)?));
        self.active = self.list.iter().filter_map(with_values).collect();
        Ok(())
    }

    /// The place of a channel, which may be new.
    fn channel(&mut self, group: &str, name: &str) -> Result<usize, Fault> {
        let key = (group.to_owned(), name.to_owned());
        if let Some(place) = self.places.get(&key) {
            return Ok(*place);
        }
        let place = self.channels.len();
        if place == MOST_CHANNELS {
            return Err(Fault::Broken(format!("it has more than {MOST_CHANNELS} channels")));
        }
        if !self.groups.contains(&key.0) {
            self.groups.push(key.0.clone());
        }
        self.channels.push(Channel {
            group: key.0.clone(),
            name: key.1.clone(),
            place,
            properties: Properties::new(),
            raw: Raw::Numbers(Vec::new()),
            index: None,
        });
        self.places.insert(key, place);
        Ok(place)
    }

    /// Puts a channel into the list of those in the segment.
    fn indexed(&mut self, place: usize, written: Written, path: &str) -> Result<(), Fault> {
        let channel = &mut self.channels[place];
        let index = match written {
            Written::None => None,
            Written::Same => {
                Some(channel.index.ok_or_else(|| Fault::Broken(format!("{path} is to be as before, and never was")))?)
            }
            Written::New(index) => {
                let before = channel.index.replace(index);
                if channel.raw.len() == 0 {
                    channel.raw = index.kind.none();
                } else if before.is_some_and(|before| before.kind != index.kind) {
                    return Err(Fault::Broken(format!("the values of {path} change their type on the way")));
                }
                Some(index)
            }
        };
        match self.list.iter_mut().find(|(other, _)| *other == place) {
            Some(entry) => entry.1 = index,
            None => self.list.push((place, index)),
        }
        Ok(())
    }

    /// Reads values: chunk by chunk, in each channel after channel or row after row.
    fn raw(&mut self, mut raw: Bytes<'_>, interleaved: bool, unfinished: bool) -> Result<(), Fault> {
        if raw.rest.is_empty() {
            return Ok(());
        }
        let part = |(_, index): &(usize, Index)| if interleaved { index.kind.size() } else { index.bytes };
        let whole = self.active.iter().try_fold(0_u64, |sum, one| sum.checked_add(part(one)));
        let whole = whole.ok_or(Fault::Cut)?;
        if whole == 0 {
            return Err(Fault::Broken("there are values of no channel".to_owned()));
        }
        let available = raw.rest.len() as u64;
        if !available.is_multiple_of(whole) {
            if !unfinished {
                return Err(Fault::Broken(format!("{available} bytes of values do not part into rows of {whole}")));
            }
            self.cut = true;
        }
        for _ in 0..available / whole {
            for (place, index) in &self.active {
                let channel = &mut self.channels[*place].raw;
                match (index.kind, interleaved) {
                    (Kind::Text, true) => {
                        return Err(Fault::Broken("texts stand among numbers row by row".to_owned()));
                    }
                    (Kind::Text, false) => {
                        let ends = raw.take(4 * index.count)?;
                        channel.push_texts(ends, raw.take(index.bytes - 4 * index.count)?, raw.big)?;
                    }
                    (kind, true) => channel.push(kind, raw.take(kind.size())?, raw.big),
                    (kind, false) => {
                        let size = usize::try_from(kind.size()).unwrap_or(1);
                        for value in raw.take(index.bytes)?.chunks_exact(size) {
                            channel.push(kind, value, raw.big);
                        }
                    }
                }
            }
        }
        Ok(())
    }
}

/// The names of a path such as `/'group'/'channel'`, in which a quotation mark of a name is doubled.
fn names(path: &str) -> Vec<String> {
    let mut names = Vec::new();
    let mut rest = path;
    while let Some(start) = rest.find("/'") {
        let mut name = String::new();
        rest = &rest[start + 2..];
        while let Some(end) = rest.find('\'') {
            name.push_str(&rest[..end]);
            rest = &rest[end + 1..];
            let Some(after) = rest.strip_prefix('\'') else { break };
            name.push('\'');
            rest = after;
        }
        names.push(name);
    }
    names
}
