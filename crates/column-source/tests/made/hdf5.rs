//! HDF5 files as MATLAB writes them with -v7.3, for tests: the oldest form of everything (The HDF Group, "HDF5 File Format
//! Specification", version 1 of object headers, groups by symbol tables, values in one piece).

/// Bytes of MATLAB's own before HDF5 begins.
const USER_BLOCK: usize = 512;
/// No address.
const NOWHERE: u64 = u64::MAX;
/// Members of a group at most.
const MOST_MEMBERS: usize = 64;

/// What a group holds.
#[derive(Debug, Clone)]
pub enum Member {
    /// Doubles of a shape, with the class that MATLAB has for them, if any.
    Doubles { shape: Vec<u64>, values: Vec<f64>, class: Option<&'static str> },
    /// Bytes, likewise.
    Bytes { shape: Vec<u64>, values: Vec<u8>, class: Option<&'static str> },
    /// Other members by name.
    Group(Vec<(&'static str, Member)>),
}

impl Member {
    /// A vector of MATLAB's that stands upright.
    pub fn vector(values: &[f64]) -> Self {
        Self::Doubles { shape: vec![1, values.len() as u64], values: values.to_vec(), class: Some("double") }
    }
}

/// A file with these members at its top.
pub fn file(members: &[(&'static str, Member)]) -> Vec<u8> {
    let mut out = Writer(vec![0; 96]);
    let (header, tree, heap) = out.group(members);
    let end = (USER_BLOCK + out.0.len()) as u64;
    let mut lead = b"\x89HDF\r\n\x1a\n\0\0\0\0\0\x08\x08\0".to_vec();
    // Half the members of a leaf, and of an inner node.
    lead.extend(numbers(&[32, 16]));
    lead.extend([0; 4]);
    lead.extend(addresses(&[USER_BLOCK as u64, NOWHERE, end, NOWHERE, 0, header]));
    lead.extend(1_u32.to_le_bytes());
    lead.extend([0; 4]);
    lead.extend(addresses(&[tree, heap]));
    out.0[..96].copy_from_slice(&lead);
    let mut block = b"MATLAB 7.3 MAT-file, made for a test".to_vec();
    block.resize(124, b' ');
    block.extend(b"\0\x02IM");
    block.resize(USER_BLOCK, 0);
    [block, out.0].concat()
}

fn addresses(all: &[u64]) -> Vec<u8> {
    all.iter().flat_map(|one| one.to_le_bytes()).collect()
}

fn numbers(all: &[u16]) -> Vec<u8> {
    all.iter().flat_map(|one| one.to_le_bytes()).collect()
}

fn short(number: usize) -> u16 {
    u16::try_from(number).expect("short")
}

fn padded(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A message of an object header.
fn message(kind: u16, body: Vec<u8>) -> Vec<u8> {
    let body = padded(body);
    [numbers(&[kind, short(body.len())]), vec![0; 4], body].concat()
}

fn space(shape: &[u64]) -> Vec<u8> {
    let rank = u8::try_from(shape.len()).expect("short");
    [vec![1, rank, 0, 0, 0, 0, 0, 0], addresses(shape)].concat()
}

/// An attribute of one text.
fn attribute(name: &str, text: &str) -> Vec<u8> {
    let name = [name.as_bytes(), b"\0"].concat();
    let size = u32::try_from(text.len()).expect("short");
    let kind = [&[0x13, 0, 0, 0][..], &size.to_le_bytes()].concat();
    let sizes = numbers(&[short(name.len()), short(kind.len()), 8]);
    message(0x0c, [vec![1, 0], sizes, padded(name), kind, space(&[]), text.as_bytes().to_vec()].concat())
}

struct Writer(Vec<u8>);

impl Writer {
    /// Writes bytes and gives their address.
    fn put(&mut self, bytes: &[u8]) -> u64 {
        let at = self.0.len() as u64;
        self.0.extend(bytes);
        self.0.resize(self.0.len().next_multiple_of(8), 0);
        at
    }

    fn header(&mut self, messages: &[Vec<u8>]) -> u64 {
        let body = messages.concat();
        let size = u32::try_from(body.len()).expect("short");
        let mut lead = vec![1, 0];
        lead.extend(numbers(&[short(messages.len())]));
        lead.extend([1_u32, size, 0].map(u32::to_le_bytes).concat());
        self.put(&[lead, body].concat())
    }

    /// The addresses of a group's header, tree and heap.
    fn group(&mut self, members: &[(&'static str, Member)]) -> (u64, u64, u64) {
        assert!(members.len() <= MOST_MEMBERS);
        let mut members = members.to_vec();
        members.sort_by_key(|(name, _)| *name);
        let (mut names, mut entries) = (vec![0; 8], Vec::new());
        let mut last = 0;
        for (name, member) in &members {
            last = names.len() as u64;
            let (header, kind, scratch) = match member {
                Member::Group(inner) => {
                    let (header, tree, heap) = self.group(inner);
                    (header, 1_u32, [tree, heap])
                }
                _ => (self.dataset(member), 0, [0, 0]),
            };
            entries.extend(addresses(&[last, header]));
            entries.extend(kind.to_le_bytes());
            entries.extend([0; 4]);
            entries.extend(addresses(&scratch));
            names.extend(padded([name.as_bytes(), b"\0"].concat()));
        }
        let names_at = self.put(&names);
        let heap = [b"HEAP\0\0\0\0".to_vec(), addresses(&[names.len() as u64, 1, names_at])].concat();
        let heap = self.put(&heap);
        entries.resize(40 * MOST_MEMBERS, 0);
        let node = self.put(&[b"SNOD\x01\0".to_vec(), numbers(&[short(members.len())]), entries].concat());
        let mut tree = [b"TREE\0\0\x01\0".to_vec(), addresses(&[NOWHERE, NOWHERE, 0, node, last])].concat();
        tree.resize(544, 0);
        let tree = self.put(&tree);
        let header = self.header(&[message(0x11, addresses(&[tree, heap]))]);
        (header, tree, heap)
    }

    fn dataset(&mut self, member: &Member) -> u64 {
        let (shape, kind, bytes, class) = match member {
            Member::Doubles { shape, values, class } => {
                let mut kind = vec![0x11, 0x20, 0x3f, 0, 8, 0, 0, 0];
                kind.extend(numbers(&[0, 64]));
                kind.extend([52, 11, 0, 52]);
                kind.extend(1023_u32.to_le_bytes());
                (shape, kind, values.iter().flat_map(|value| value.to_le_bytes()).collect(), class)
            }
            Member::Bytes { shape, values, class } => {
                (shape, vec![0x10, 0, 0, 0, 1, 0, 0, 0, 0, 0, 8, 0], values.clone(), class)
            }
            Member::Group(_) => unreachable!("a group is no dataset"),
        };
        let at = self.put(&bytes);
        let place = [vec![3, 1], addresses(&[at, bytes.len() as u64])].concat();
        let mut messages = vec![
            message(0x01, space(shape)),
            message(0x03, kind),
            message(0x05, vec![2, 2, 2, 0]),
            message(0x08, place),
        ];
        messages.extend(class.map(|class| attribute("MATLAB_class", class)));
        self.header(&messages)
    }
}
