//! From bytes to UTF-8 text.

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};

use crate::{Notice, NoticeKind, RecordProblem};

/// A line and why the text ends there.
type Refused = (usize, RecordProblem);

/// Unpacked, a file is at most this long: a small one can unpack to anything.
#[cfg(feature = "gzip")]
const LONGEST_UNPACKED: u64 = 2 << 30;

/// The text with the guesses made, or the line and the reason why it is none.
pub(crate) fn text(bytes: &[u8]) -> Result<(Vec<u8>, Vec<Notice>), Refused> {
    if bytes.starts_with(&[0x1f, 0x8b]) {
        return plain(&unpacked(bytes)?);
    }
    plain(bytes)
}

#[cfg(feature = "gzip")]
fn unpacked(bytes: &[u8]) -> Result<Vec<u8>, Refused> {
    use std::io::Read;

    let refuse = |reason: String| (1, RecordProblem::NotUnpacked { reason });
    let mut text = Vec::new();
    let mut unpacker = flate2::read::MultiGzDecoder::new(bytes).take(LONGEST_UNPACKED);
    unpacker.read_to_end(&mut text).map_err(|error| refuse(error.to_string()))?;
    if text.len() as u64 == LONGEST_UNPACKED {
        return Err(refuse(format!("it is longer than {LONGEST_UNPACKED} bytes")));
    }
    Ok(text)
}

#[cfg(not(feature = "gzip"))]
fn unpacked(_: &[u8]) -> Result<Vec<u8>, Refused> {
    Err((1, RecordProblem::Compressed))
}

fn plain(bytes: &[u8]) -> Result<(Vec<u8>, Vec<Notice>), Refused> {
    let (encoding, bytes) = match Encoding::for_bom(bytes) {
        Some((encoding, length)) => (encoding, &bytes[length..]),
        None => (utf_16_without_mark(bytes).unwrap_or(encoding_rs::UTF_8), bytes),
    };
    if encoding == encoding_rs::UTF_8 {
        let Err(bad) = std::str::from_utf8(bytes) else {
            return checked(bytes.to_vec(), Vec::new());
        };
        // A byte that is no UTF-8 is an umlaut or a degree sign of an older system, if it is text at all.
        let line = line_of(bytes, bad.valid_up_to());
        let (text, _) = WINDOWS_1252.decode_without_bom_handling(bytes);
        let notice = Notice { line, kind: NoticeKind::Encoding { encoding: "Windows-1252 (Latin-1)" } };
        return checked(text.into_owned().into_bytes(), vec![notice]);
    }
    let (text, broken) = encoding.decode_without_bom_handling(bytes);
    if broken {
        return Err((1, RecordProblem::NotText));
    }
    let notice = Notice { line: 1, kind: NoticeKind::Encoding { encoding: encoding.name() } };
    checked(text.into_owned().into_bytes(), vec![notice])
}

/// Every other byte of ASCII text in UTF-16 is zero.
fn utf_16_without_mark(bytes: &[u8]) -> Option<&'static Encoding> {
    let head = &bytes[..bytes.len().min(64) / 2 * 2];
    if head.len() < 8 {
        return None;
    }
    let zeros = |odd: usize| head.iter().skip(odd).step_by(2).filter(|byte| **byte == 0).count();
    let half = head.len() / 2;
    match (zeros(0), zeros(1)) {
        (0, odd) if odd * 4 > half * 3 => Some(UTF_16LE),
        (even, 0) if even * 4 > half * 3 => Some(UTF_16BE),
        _ => None,
    }
}

/// Refuses text with control characters, which no table has.
fn checked(mut text: Vec<u8>, notices: Vec<Notice>) -> Result<(Vec<u8>, Vec<Notice>), Refused> {
    // Some editors end a file with the old end-of-text character.
    if text.ends_with(b"\x1a") {
        text.pop();
    }
    match text.iter().position(|byte| *byte < b' ' && !b"\t\r\n\x0c".contains(byte)) {
        Some(offset) => Err((line_of(&text, offset), RecordProblem::NotText)),
        None => Ok((text, notices)),
    }
}

fn line_of(bytes: &[u8], offset: usize) -> usize {
    bytes[..offset].split(|byte| *byte == b'\n').count()
}
