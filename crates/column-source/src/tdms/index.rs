//! What a segment says of the values of a channel.

use super::bytes::{Bytes, Fault};
use super::values::Kind;

/// No values in this segment.
const NONE: u32 = 0xffff_ffff;
/// As in the segment before.
const SAME: u32 = 0;
/// Values of NI-DAQmx: codes of converters, and lines of digital ports.
const DAQMX: [u32; 2] = [0x0000_1269, 0x0000_126a];

/// Type and number of a channel's values in each chunk of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Index {
    pub kind: Kind,
    pub count: u64,
    /// Bytes of a chunk.
    pub bytes: u64,
}

/// An index as it is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Written {
    None,
    Same,
    New(Index),
}

/// Reads an index; `path` is what messages call the channel.
pub(super) fn read(bytes: &mut Bytes<'_>, path: &str) -> Result<Written, Fault> {
    match bytes.u32()? {
        NONE => return Ok(Written::None),
        SAME => return Ok(Written::Same),
        daqmx if DAQMX.contains(&daqmx) => {
            return Err(Fault::NotRead {
                found: format!("raw data of NI-DAQmx in channel {path}"),
                instead: "log it scaled, or export it as CSV, from DIAdem, Excel with NI's add-in, or Python with npTDMS",
            });
        }
        _ => {}
    }
    let code = bytes.u32()?;
    let kind = Kind::of(code).ok_or_else(|| Fault::NotRead {
        found: format!("values of the type {code:#x} in channel {path}"),
        instead: "save the channel as numbers of 64 bits, or export it as CSV",
    })?;
    if bytes.u32()? != 1 {
        return Err(Fault::Broken(format!("channel {path} has values of more than one dimension")));
    }
    let count = bytes.u64()?;
    let size = match kind {
        Kind::Text => Some(bytes.u64()?).filter(|size| count.checked_mul(4).is_some_and(|ends| ends <= *size)),
        _ => count.checked_mul(kind.size()),
    };
    let size = size.ok_or_else(|| Fault::Broken(format!("channel {path} has more values than there can be")))?;
    Ok(Written::New(Index { kind, count, bytes: size }))
}
