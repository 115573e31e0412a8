//! A report: one self-contained HTML page of short texts, tables and figures.

use std::fmt::Write;

use chart::Figure;

/// What a text is coloured for; its words say the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// Stands out.
    Strong,
    /// Needs somebody now.
    Bad,
    /// Will need somebody.
    Caution,
    /// Worth a look.
    Note,
    /// As it should be.
    Good,
    /// Not known.
    Faint,
}

impl Tone {
    /// The class of the page's style.
    const fn class(self) -> &'static str {
        match self {
            Self::Strong => "strong",
            Self::Bad => "bad",
            Self::Caution => "caution",
            Self::Note => "note",
            Self::Good => "good",
            Self::Faint => "faint",
        }
    }
}

/// One cell of a table.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Cell {
    /// What is read.
    pub text: String,
    /// What it is coloured for.
    pub tone: Option<Tone>,
}

impl Cell {
    /// A cell with a tone.
    pub fn toned(text: impl Into<String>, tone: Tone) -> Self {
        Self { text: text.into(), tone: Some(tone) }
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self { text, tone: None }
    }
}

/// A table of the report: what people read, already formatted.
#[derive(Debug, Clone, Default)]
pub struct Table {
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// The rows.
    pub rows: Vec<Vec<Cell>>,
}

impl Table {
    /// A table of plain texts.
    pub fn of_texts<const N: usize>(columns: [&str; N], rows: Vec<Vec<String>>) -> Self {
        let cells = |row: Vec<String>| row.into_iter().map(Cell::from).collect();
        Self { columns: columns.map(str::to_owned).into(), rows: rows.into_iter().map(cells).collect() }
    }
}

/// One block of a section.
#[derive(Debug, Clone)]
pub enum Block {
    /// A paragraph.
    Text(String),
    /// A warning or a verdict, set off from the text.
    Callout(String),
    /// A table.
    Table(Table),
    /// A picture.
    Figure(Box<Figure>),
    /// Text to be copied, such as a piece of a valve file.
    Code(String),
}

/// A section with its headline.
#[derive(Debug, Clone, Default)]
pub struct Section {
    /// The headline.
    pub title: String,
    /// What it holds.
    pub blocks: Vec<Block>,
}

/// A whole page.
#[derive(Debug, Clone, Default)]
pub struct Page {
    /// The headline.
    pub title: String,
    /// A line below it.
    pub subtitle: String,
    /// The sections.
    pub sections: Vec<Section>,
    /// The last line: program and version.
    pub footer: String,
}

const STYLE: &str = "\
body{font:15px/1.5 system-ui,'Helvetica Neue',Arial,sans-serif;color:#222;background:#fff;\
max-width:820px;margin:2em auto;padding:0 1em}\
h1{font-size:1.6em;margin-bottom:0}h2{font-size:1.2em;margin-top:2em;\
border-bottom:1px solid #ddd;padding-bottom:.2em}\
.sub,footer{color:#5a5a5a}footer{margin-top:3em;font-size:.85em}\
.callout{border-left:4px solid #0072b2;background:#f2f7fb;padding:.6em 1em;margin:1em 0}\
table{border-collapse:collapse;font-size:.92em;margin:1em 0}\
th,td{padding:.25em .9em;text-align:right;border-bottom:1px solid #e4e4e4}\
th:first-child,td:first-child{text-align:left}th{border-bottom:2px solid #8c8c8c}\
td.strong,td.bad{font-weight:600}td.bad{color:#9c2a00}td.caution{color:#8a5a00}td.note{color:#005a9c}\
td.good{color:#00664a}td.faint{color:#5a5a5a}\
pre{background:#f6f6f6;padding:.8em 1em;overflow-x:auto;font-size:.9em}\
figure{margin:1em 0}figure svg{max-width:100%;height:auto}\
nav a{margin-right:1.2em}@media print{nav{display:none}}";

impl Page {
    /// The page as HTML that needs no other file.
    pub fn to_html(&self) -> String {
        let mut out = String::with_capacity(64 * 1024);
        let title = escape(&self.title);
        let _ = write!(
            out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n"
        );
        if !self.subtitle.is_empty() {
            let _ = writeln!(out, "<p class=\"sub\">{}</p>", escape(&self.subtitle));
        }
        if self.sections.len() > 1 {
            out.push_str("<nav>");
            for (index, section) in self.sections.iter().enumerate() {
                let _ = write!(out, "<a href=\"#s{index}\">{}</a>", escape(&section.title));
            }
            out.push_str("</nav>\n");
        }
        for (index, section) in self.sections.iter().enumerate() {
            let _ = writeln!(out, "<h2 id=\"s{index}\">{}</h2>", escape(&section.title));
            for block in &section.blocks {
                write_block(&mut out, block);
            }
        }
        if !self.footer.is_empty() {
            let _ = writeln!(out, "<footer>{}</footer>", escape(&self.footer));
        }
        out.push_str("</body>\n</html>\n");
        out
    }
}

fn write_block(out: &mut String, block: &Block) {
    let _ = match block {
        Block::Text(text) => writeln!(out, "<p>{}</p>", escape(text)),
        Block::Callout(text) => writeln!(out, "<p class=\"callout\">{}</p>", escape(text)),
        Block::Code(text) => writeln!(out, "<pre>{}</pre>", escape(text)),
        Block::Figure(figure) => writeln!(out, "<figure>\n{}</figure>", figure.to_svg()),
        Block::Table(table) => {
            write_table(out, table);
            Ok(())
        }
    };
}

fn write_table(out: &mut String, table: &Table) {
    out.push_str("<table>\n<thead><tr>");
    for column in &table.columns {
        let _ = write!(out, "<th>{}</th>", escape(column));
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for cell in row {
            let class = cell.tone.map_or_else(String::new, |tone| format!(" class=\"{}\"", tone.class()));
            let _ = write!(out, "<td{class}>{}</td>", escape(&cell.text));
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n");
}

fn escape(text: &str) -> String {
    let text: String = text.chars().filter(|letter| !letter.is_control() || "\n\t".contains(*letter)).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_holds_its_parts_and_escapes_them() {
        let mut table = Table::of_texts(["step", "error"], vec![vec!["a < b".to_owned(), "1.0".to_owned()]]);
        table.rows[0].push(Cell::toned("act-now", Tone::Bad));
        let section =
            Section { title: "Errors".to_owned(), blocks: vec![Block::Table(table), Block::Text("x & y".to_owned())] };
        let page = Page { title: "DV-1".to_owned(), sections: vec![section], ..Page::default() };
        let html = page.to_html();
        assert!(html.contains("<td>a &lt; b</td>"));
        assert!(html.contains("<td class=\"bad\">act-now</td>"));
        assert!(html.contains("<p>x &amp; y</p>"));
        assert!(!html.contains("src="), "the page must not need other files");
    }
}
