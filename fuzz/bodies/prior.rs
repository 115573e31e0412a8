//! What sister valves have taught, and a few rows by it.

use std::sync::{Arc, LazyLock};

use leak_table::TableBundle;
use prognoser::{Learned, LogRow, Method, Prognoser, Reading};

static TABLES: LazyLock<Arc<TableBundle>> = LazyLock::new(|| {
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let tables = [dir.join("tables"), dir.join("../tables")].into_iter().find(|dir| dir.exists()).expect("tables");
    Arc::new(TableBundle::read(&tables).expect("the reference valve's tables"))
});

/// Looks at an input.
pub fn look(bytes: &[u8]) {
    let text = String::from_utf8_lossy(bytes);
    let Ok(learned) = toml_edit::de::from_str::<Learned>(&text) else { return };
    let Ok(learned) = learned.checked() else { return };
    let mut prognoser = Prognoser::new(Arc::clone(&TABLES), Method::Bayes(learned.config()));
    for cycle in 1..8 {
        let close = 1.04 + 0.03 * cycle as f64;
        let reading = Reading { cycle, close_time_s: Some(close), open_time_s: Some(2.1), ..Reading::default() };
        let told = prognoser.push(&LogRow { valve: "V", reading, time: None, line: cycle });
        let numbers = [told.rul_cycles, told.rul_p05, told.rul_p95, told.leak_area_mm2, told.noise_s, told.severity];
        assert!(numbers.into_iter().flatten().all(f64::is_finite), "{told:?}\n{text}");
    }
}
