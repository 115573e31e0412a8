//! TDMS files for tests, as National Instruments' "TDMS File Format Internal Structure" describes them.

/// Values of a channel.
#[derive(Debug, Clone)]
pub enum Data {
    Double(Vec<f64>),
    Single(Vec<f32>),
    Short(Vec<i16>),
    Boolean(Vec<u8>),
    Text(Vec<&'static str>),
    /// Seconds since 1904, and the part of a second in 2^-64 s.
    Time(Vec<(i64, u64)>),
    /// So many bytes of a type.
    Other(u32, usize, Vec<u8>),
}

/// The value of a property.
#[derive(Debug, Clone, Copy)]
pub enum Value {
    Number(f64),
    Count(u32),
    Text(&'static str),
    Time(i64, u64),
}

/// A file, a group or a channel.
#[derive(Debug, Clone)]
pub struct Object {
    pub path: String,
    pub properties: Vec<(&'static str, Value)>,
    pub data: Option<Data>,
}

impl Object {
    pub fn channel(group: &str, name: &str, data: Data) -> Self {
        let path = format!("/'{}'/'{}'", group.replace('\'', "''"), name.replace('\'', "''"));
        Self { path, properties: Vec::new(), data: Some(data) }
    }

    pub fn with(mut self, name: &'static str, value: Value) -> Self {
        self.properties.push((name, value));
        self
    }
}

/// How a segment is written.
#[derive(Debug, Clone, Copy)]
pub struct Form {
    pub big: bool,
    pub interleaved: bool,
    /// Into how many chunks the values are parted.
    pub chunks: usize,
}

pub const PLAIN: Form = Form { big: false, interleaved: false, chunks: 1 };

/// A number in the order of a segment's bytes.
fn ordered<const N: usize>(little: [u8; N], big: bool) -> Vec<u8> {
    let mut bytes = little.to_vec();
    if big {
        bytes.reverse();
    }
    bytes
}

fn word(number: usize, big: bool) -> Vec<u8> {
    ordered(u32::try_from(number).expect("short").to_le_bytes(), big)
}

fn long(number: usize, big: bool) -> Vec<u8> {
    ordered((number as u64).to_le_bytes(), big)
}

fn text(text: &str, big: bool) -> Vec<u8> {
    [word(text.len(), big), text.as_bytes().to_vec()].concat()
}

fn time((seconds, fraction): (i64, u64), big: bool) -> Vec<u8> {
    let mut bytes = [fraction.to_le_bytes(), seconds.to_le_bytes()].concat();
    if big {
        bytes.reverse();
    }
    bytes
}

impl Value {
    fn bytes(self, big: bool) -> Vec<u8> {
        match self {
            Self::Number(number) => [word(10, big), ordered(number.to_le_bytes(), big)].concat(),
            Self::Count(count) => [word(7, big), ordered(count.to_le_bytes(), big)].concat(),
            Self::Text(words) => [word(0x20, big), text(words, big)].concat(),
            Self::Time(seconds, fraction) => [word(0x44, big), time((seconds, fraction), big)].concat(),
        }
    }
}

impl Data {
    fn kind(&self) -> usize {
        match self {
            Self::Double(_) => 10,
            Self::Single(_) => 9,
            Self::Short(_) => 2,
            Self::Boolean(_) => 0x21,
            Self::Text(_) => 0x20,
            Self::Time(_) => 0x44,
            Self::Other(kind, ..) => *kind as usize,
        }
    }

    /// Each value as bytes.
    fn values(&self, big: bool) -> Vec<Vec<u8>> {
        match self {
            Self::Double(numbers) => numbers.iter().map(|number| ordered(number.to_le_bytes(), big)).collect(),
            Self::Single(numbers) => numbers.iter().map(|number| ordered(number.to_le_bytes(), big)).collect(),
            Self::Short(numbers) => numbers.iter().map(|number| ordered(number.to_le_bytes(), big)).collect(),
            Self::Boolean(numbers) => numbers.iter().map(|number| vec![*number]).collect(),
            Self::Text(texts) => texts.iter().map(|text| text.as_bytes().to_vec()).collect(),
            Self::Time(times) => times.iter().map(|moment| time(*moment, big)).collect(),
            Self::Other(_, size, bytes) => bytes.chunks(*size).map(<[u8]>::to_vec).collect(),
        }
    }
}

/// The values of some rows, texts with where they end before them.
fn chunk(data: &Data, rows: std::ops::Range<usize>, big: bool) -> Vec<u8> {
    let values = &data.values(big)[rows];
    let mut ends = Vec::new();
    if let Data::Text(_) = data {
        let mut end = 0;
        for value in values {
            end += value.len();
            ends.extend(word(end, big));
        }
    }
    [ends, values.concat()].concat()
}

/// The values of a segment.
pub fn raw(objects: &[Object], form: Form) -> Vec<u8> {
    let all: Vec<&Data> = objects.iter().filter_map(|object| object.data.as_ref()).collect();
    let rows = |data: &Data| data.values(false).len();
    if form.interleaved {
        let values: Vec<Vec<Vec<u8>>> = all.iter().map(|data| data.values(form.big)).collect();
        return (0..rows(all[0])).flat_map(|row| values.iter().flat_map(move |column| column[row].clone())).collect();
    }
    let part = |index: usize| {
        let of = move |data: &&Data| {
            let count = rows(data) / form.chunks;
            chunk(data, index * count..(index + 1) * count, form.big)
        };
        all.iter().flat_map(of).collect::<Vec<u8>>()
    };
    (0..form.chunks).flat_map(part).collect()
}

/// A segment with a list of objects of its own.
pub fn segment(objects: &[Object], form: Form) -> Vec<u8> {
    let mut metadata = word(objects.len(), form.big);
    for object in objects {
        metadata.extend(text(&object.path, form.big));
        match &object.data {
            None => metadata.extend([0xff; 4]),
            Some(data) => {
                let is_text = matches!(data, Data::Text(_));
                let count = data.values(false).len() / form.chunks;
                metadata.extend(word(if is_text { 28 } else { 20 }, form.big));
                metadata.extend(word(data.kind(), form.big));
                metadata.extend(word(1, form.big));
                metadata.extend(long(count, form.big));
                if is_text {
                    metadata.extend(long(chunk(data, 0..count, form.big).len(), form.big));
                }
            }
        }
        metadata.extend(word(object.properties.len(), form.big));
        for (name, value) in &object.properties {
            metadata.extend(text(name, form.big));
            metadata.extend(value.bytes(form.big));
        }
    }
    let raw = if objects.iter().any(|object| object.data.is_some()) { raw(objects, form) } else { Vec::new() };
    // Metadata, a new list of objects, values.
    framed(&metadata, &raw, 0b1110, form)
}

/// A segment of metadata and values as they are.
pub fn framed(metadata: &[u8], raw: &[u8], flags: u32, form: Form) -> Vec<u8> {
    let flags = flags | u32::from(form.interleaved) << 5 | u32::from(form.big) << 6;
    let mut bytes = b"TDSm".to_vec();
    bytes.extend(flags.to_le_bytes());
    bytes.extend(word(4713, form.big));
    bytes.extend(long(metadata.len() + raw.len(), form.big));
    bytes.extend(long(metadata.len(), form.big));
    [&bytes, metadata, raw].concat()
}
