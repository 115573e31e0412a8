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
    /// Something to hover over, zoom and sort.
    View(View),
}

/// Blocks of which the page's script makes something to hover over, zoom and sort. Without scripts and on paper they stand
/// there as they are.
#[derive(Debug, Clone)]
pub struct View {
    /// Which of the script's views it becomes.
    pub kind: &'static str,
    /// The name of the page's data that it shows.
    pub of: &'static str,
    /// The same, still.
    pub still: Vec<Block>,
}

/// One of the few sentences at the top of a page: how it stands, what is worst, what to do.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Point {
    /// What it is about.
    pub lead: &'static str,
    /// What there is to say.
    pub text: String,
    /// A command to be copied.
    pub command: Option<String>,
}

impl Point {
    /// A sentence.
    pub fn new(lead: &'static str, text: impl Into<String>) -> Self {
        Self { lead, text: text.into(), command: None }
    }
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
    /// What a reader must know, in a few sentences.
    pub short: Vec<Point>,
    /// The sections.
    pub sections: Vec<Section>,
    /// The last line: program and version.
    pub footer: String,
    /// The style sheet.
    pub style: String,
    /// The script that makes the views.
    pub script: String,
    /// What the views show: JSON texts by name.
    pub data: Vec<(&'static str, String)>,
}

/// What the page may do: what is inside it, and nothing else.
const RULES: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                     form-action 'none'";

impl Page {
    /// The page as HTML that needs no other file.
    pub fn to_html(&self) -> String {
        let mut out = String::with_capacity(64 * 1024);
        let title = escape(&self.title);
        let _ = write!(
            out,
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{RULES}\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n<link rel=\"icon\" href=\"data:,\">\n\
             <title>{title}</title>\n<style>{}</style>\n</head>\n<body class=\"report\">\n<h1>{title}</h1>\n",
            self.style
        );
        if !self.subtitle.is_empty() {
            let _ = writeln!(out, "<p class=\"sub\">{}</p>", escape(&self.subtitle));
        }
        if !self.short.is_empty() {
            out.push_str("<ul class=\"in-short\">\n");
            for Point { lead, text, command } in &self.short {
                let _ = write!(out, "<li><strong>{}:</strong> {}", escape(lead), escape(text));
                if let Some(command) = command {
                    let _ = write!(out, "<pre>{}</pre>", escape(command));
                }
                out.push_str("</li>\n");
            }
            out.push_str("</ul>\n");
        }
        if self.sections.len() > 1 {
            out.push_str("<nav aria-label=\"sections\">");
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
        for (name, json) in &self.data {
            // The sign stands in strings alone, where it can be told by its number.
            let json = json.replace('<', "\\u003c");
            let _ = writeln!(out, "<script type=\"application/json\" id=\"data-{name}\">{json}</script>");
        }
        if !self.script.is_empty() {
            let _ = writeln!(out, "<script>{}</script>", self.script);
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
        Block::View(View { kind, of, still }) => {
            let _ = writeln!(out, "<div data-view=\"{kind}\" data-of=\"{of}\">\n<div class=\"still\">");
            for block in still {
                write_block(out, block);
            }
            writeln!(out, "</div>\n</div>")
        }
        Block::Table(table) => {
            write_table(out, table);
            Ok(())
        }
    };
}

fn write_table(out: &mut String, table: &Table) {
    let name = escape(&table.columns.join(", "));
    let _ = write!(
        out,
        "<div class=\"table\" tabindex=\"0\" role=\"group\" aria-label=\"table: {name}\"><table class=\"{}\">\n<thead><tr>",
        text_columns(table)
    );
    for column in &table.columns {
        let _ = write!(out, "<th scope=\"col\">{}</th>", escape(column));
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
    out.push_str("</tbody>\n</table></div>\n");
}

/// The columns that hold texts, which stand left, by their numbers: "t2 t5".
fn text_columns(table: &Table) -> String {
    let is_number = |text: &str| text.starts_with(|first: char| first.is_ascii_digit() || "+-−".contains(first));
    let is_text = |column: &usize| {
        let cells = table.rows.iter().filter_map(|row| row.get(*column)).filter(|cell| cell.text.len() > 1);
        let (texts, numbers): (Vec<&Cell>, Vec<&Cell>) = cells.partition(|cell| !is_number(&cell.text));
        texts.len() > numbers.len()
    };
    let columns = (1..table.columns.len()).filter(is_text).map(|column| format!("t{}", column + 1));
    columns.collect::<Vec<_>>().join(" ")
}

fn escape(text: &str) -> String {
    let text: String = text.chars().filter(|letter| !letter.is_control() || "\n\t".contains(*letter)).collect();
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn page_holds_its_parts_and_escapes_them() {
        let mut table = Table::of_texts(["step", "error", "state"], vec![vec!["a < b".to_owned(), "1.0".to_owned()]]);
        table.rows[0].push(Cell::toned("act-now", Tone::Bad));
        let section =
            Section { title: "Errors".to_owned(), blocks: vec![Block::Table(table), Block::Text("x & y".to_owned())] };
        let view = View { kind: "fleet", of: "log", still: vec![Block::Text("still".to_owned())] };
        let data = vec![("log", r#"{"valve":"</script><b>"}"#.to_owned())];
        let live = Section { title: "Live".to_owned(), blocks: vec![Block::View(view)] };
        let page = Page { title: "DV-1".to_owned(), sections: vec![section, live], data, ..Page::default() };
        let html = page.to_html();
        assert!(html.contains("<div data-view=\"fleet\" data-of=\"log\">\n<div class=\"still\">\n<p>still</p>"));
        assert!(html.contains(r#"{"valve":"\u003c/script>\u003cb>"}</script>"#), "no text ends the data");
        assert!(html.contains("<table class=\"t3\">"), "texts stand left");
        assert!(html.contains("<td>a &lt; b</td>"));
        assert!(html.contains("<td class=\"bad\">act-now</td>"));
        assert!(html.contains("<p>x &amp; y</p>"));
        assert!(!html.contains("src="), "the page must not need other files");
    }
}
