//! Prose broken into lines that fit, numbers kept beside their units.

/// Breaks the lines of a text that are longer than so many columns. Lines with columns of their own (two blanks in
/// them) or indented by four or more are commands, files and tables, and stay as they are.
pub fn wrapped(text: &str, columns: usize) -> String {
    let mut out = String::with_capacity(text.len() + text.len() / 40);
    for line in text.split_inclusive('\n') {
        let (body, end) = line.strip_suffix('\n').map_or((line, ""), |body| (body, "\n"));
        let indent = body.len() - body.trim_start_matches(' ').len();
        if body.chars().count() <= columns || indent >= 4 || body.trim().contains("  ") {
            out.push_str(body);
        } else {
            out.push_str(&broken(&body[indent..], columns, indent, indent + hanging(&body[indent..])));
        }
        out.push_str(end);
    }
    out
}

/// By how much later lines of a paragraph stand further in: as far as what is numbered, else two.
fn hanging(text: &str) -> usize {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    if digits > 0 && text[digits..].starts_with(". ") { digits + 2 } else { 2 }
}

/// One paragraph in lines, the first and the later ones with an indent of their own.
fn broken(text: &str, columns: usize, first: usize, later: usize) -> String {
    let mut out = " ".repeat(first);
    let mut column = first;
    let mut is_first = true;
    for piece in pieces(text) {
        let width = piece.chars().count();
        if !is_first && column + 1 + width > columns {
            out.push('\n');
            out.push_str(&" ".repeat(later));
            column = later;
        } else if !is_first {
            out.push(' ');
            column += 1;
        }
        out.push_str(&piece);
        column += width;
        is_first = false;
    }
    out
}

/// The words of a paragraph; a number and what belongs to it, or a range of numbers, as one.
pub fn pieces(text: &str) -> Vec<String> {
    let mut pieces: Vec<String> = Vec::new();
    let mut last = "";
    let words: Vec<&str> = text.split(' ').filter(|word| !word.is_empty()).collect();
    for (index, word) in words.iter().copied().enumerate() {
        let number = |word: &str| word.trim_start_matches(['(', '+', '-']).starts_with(|c: char| c.is_ascii_digit());
        let is_unit = |word: &str| word.trim_end_matches([',', ';', ')', '.', ':']).chars().count() <= 4;
        let is_to = |at: usize| {
            words.get(at) == Some(&"to")
                && at > 0
                && number(words[at - 1])
                && words.get(at + 1).is_some_and(|next| number(next))
        };
        let belongs = (number(last) && !number(word) && is_unit(word) && last.ends_with(|c: char| c.is_ascii_digit()))
            || word == "+-"
            || last == "+-"
            || is_to(index)
            || (index > 0 && is_to(index - 1));
        match pieces.last_mut() {
            Some(piece) if belongs => {
                piece.push(' ');
                piece.push_str(word);
            }
            _ => pieces.push(word.to_owned()),
        }
        last = word;
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_broken_and_numbers_stay_whole() {
        let text = "the model breaks away 59 ms early, and is 0.25 +- 0.01 mm off\n";
        let lines = wrapped(text, 26);
        assert_eq!(lines, "the model breaks away\n  59 ms early, and is\n  0.25 +- 0.01 mm off\n");
        assert_eq!(lines.split_whitespace().collect::<Vec<_>>(), text.split_whitespace().collect::<Vec<_>>());
    }

    #[test]
    fn ranges_stay_whole_and_numbered_lines_hang() {
        assert_eq!(wrapped("1. cycles left, 5 to 95 %\n", 20), "1. cycles left,\n   5 to 95 %\n");
    }

    #[test]
    fn commands_and_tables_stay() {
        let text = "    valve compare a-long-name.toml another-long-name.toml\nname   of a column   and another one\n";
        assert_eq!(wrapped(text, 20), text);
    }
}
