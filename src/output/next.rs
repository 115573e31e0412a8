//! What to do next, as commands that can be pasted as they stand.

use std::ffi::OsStr;
use std::path::Path;

use super::manner;

/// Columns of a command line before it goes on after a backslash.
const COMMAND_COLUMNS: usize = 76;

/// A step that is worth doing next: why, and the command that does it. Nothing where the user wants results only.
pub fn next_step(why: &str, arguments: &[&str]) -> String {
    if manner().quiet {
        return String::new();
    }
    format!("\nnext: {why}\n{}", command(arguments))
}

/// A call of the program for a POSIX shell, indented, on several lines where it is long.
pub fn command(arguments: &[&str]) -> String {
    let mut text = String::from("    valve");
    let mut column = text.len();
    let mut rest = arguments.iter().peekable();
    while let Some(argument) = rest.next() {
        // An option and what belongs to it stay together.
        let value = rest.next_if(|next| argument.starts_with("--") && !next.starts_with("--"));
        let word = [Some(argument), value].into_iter().flatten().map(|word| quoted(word)).collect::<Vec<_>>().join(" ");
        let width = word.chars().count();
        if column + 1 + width > COMMAND_COLUMNS && column > 8 {
            text.push_str(" \\\n       ");
            column = 7;
        }
        text.push(' ');
        text.push_str(&word);
        column += 1 + width;
    }
    text.push('\n');
    text
}

/// A word as a shell reads it back.
fn quoted(word: &str) -> String {
    let plain = |letter: char| letter.is_alphanumeric() || "-_./=:,+@%*".contains(letter);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}

/// A new file or directory beside a valve file, where all that is known of the valve stays together: the name wished
/// for, with a number behind it where that is taken.
pub fn free_name_beside(valve: &Path, wished: &str) -> String {
    free_name(&valve.with_file_name(wished).display().to_string())
}

/// The same in the working directory: the name wished for, or one with a number behind it that does not exist yet.
pub fn free_name(wished: &str) -> String {
    if !Path::new(wished).exists() {
        return wished.to_owned();
    }
    // The ending of the name, and not of a folder on the way such as "..".
    let path = Path::new(wished);
    let part = |part: Option<&OsStr>| part.map(|part| part.to_string_lossy().into_owned());
    let (stem, ending) = (part(path.file_stem()).unwrap_or_default(), part(path.extension()));
    let ending = ending.map(|ending| format!(".{ending}")).unwrap_or_default();
    let mut numbered = (2_u32..).map(|number| path.with_file_name(format!("{stem}-{number}{ending}")));
    numbered.find(|name| !name.exists()).map_or_else(|| wished.to_owned(), |name| name.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_can_be_pasted() {
        assert_eq!(command(&["compare", "valve.toml"]), "    valve compare valve.toml\n");
        assert_eq!(command(&["compare", "it's mine.toml"]), "    valve compare 'it'\\''s mine.toml'\n");
        let long = "a".repeat(40);
        let lines = command(&["adopt", &long, &long, "--out", "better.toml"]);
        assert_eq!(lines, format!("    valve adopt {long} \\\n        {long} --out better.toml\n"));
        let lines = command(&["adopt", &"a".repeat(52), "--out", "better.toml"]);
        assert!(lines.ends_with(" \\\n        --out better.toml\n"), "{lines}");
    }

    #[test]
    fn a_name_that_is_taken_gets_a_number() {
        let dir = tempfile::tempdir().unwrap();
        let wished = dir.path().join("better.toml").display().to_string();
        assert_eq!(free_name(&wished), wished);
        std::fs::write(&wished, "").unwrap();
        assert_eq!(free_name(&wished), wished.replace("better", "better-2"));
        let folder = dir.path().join("plant");
        std::fs::create_dir_all(folder.join("tables")).unwrap();
        let wished = folder.join("..").join("plant").join("tables").display().to_string();
        assert_eq!(free_name(&wished), format!("{wished}-2"));
    }
}
