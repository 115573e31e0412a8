//! The text format of Prometheus, version 0.0.4.

use std::fmt::Write;

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It only grows while the process runs.
    Counter,
    /// It goes up and down.
    Gauge,
}

/// A text of metrics.
#[derive(Debug, Default)]
pub struct MetricsText(String);

impl MetricsText {
    /// Begins a metric: its name, which ends in `_total` for a counter, and what it is.
    pub fn metric(&mut self, name: &str, kind: Kind, help: &str) -> &mut Self {
        let kind = match kind {
            Kind::Counter => "counter",
            Kind::Gauge => "gauge",
        };
        // Writing to memory cannot fail.
        let _ =
            writeln!(self.0, "# HELP {name} {}\n# TYPE {name} {kind}", help.replace('\\', "\\\\").replace('\n', "\\n"));
        self
    }

    /// A value of a metric.
    pub fn value(&mut self, name: &str, value: f64) -> &mut Self {
        let _ = writeln!(self.0, "{name} {value}");
        self
    }

    /// A value under a label.
    pub fn labelled(&mut self, name: &str, label: (&str, &str), value: f64) -> &mut Self {
        let text = label.1.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
        let _ = writeln!(self.0, "{name}{{{}=\"{text}\"}} {value}", label.0);
        self
    }

    /// The text.
    pub fn into_text(self) -> String {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_below_what_they_are() {
        let mut text = MetricsText::default();
        text.metric("rows_total", Kind::Counter, "Rows\nread.").value("rows_total", 7.0);
        text.metric("valves", Kind::Gauge, "Valves.").labelled("valves", ("status", "a\"b\\"), 0.5);
        assert_eq!(
            text.into_text(),
            "# HELP rows_total Rows\\nread.\n# TYPE rows_total counter\nrows_total 7\n\
             # HELP valves Valves.\n# TYPE valves gauge\nvalves{status=\"a\\\"b\\\\\"} 0.5\n"
        );
    }
}
