//! What the built program says of a campaign, by its JSON alone.

use std::fs::File;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail};
use serde_json::Value;

use crate::answer::{Answer, Fitted};

/// How often a running program is looked at.
const LOOK: Duration = Duration::from_millis(20);

/// Runs `explain` of the program on the campaign in a folder, and gives it up after `limit`.
pub fn from_program(program: &Path, folder: &Path, limit: Duration) -> Result<Answer> {
    let output = tempfile::tempdir()?;
    let (out, err) = (output.path().join("out.json"), output.path().join("err.txt"));
    let mut child = Command::new(program)
        .arg("explain")
        .arg(folder.join("valve.toml"))
        .arg(folder.join("campaign.toml"))
        .args(["--format", "json"])
        .stdin(Stdio::null())
        .stdout(File::create(&out)?)
        .stderr(File::create(&err)?)
        .spawn()
        .with_context(|| format!("{} cannot be run", program.display()))?;
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            bail!("no answer within {:.0} s", limit.as_secs_f64());
        }
        std::thread::sleep(LOOK);
    };
    let said = std::fs::read_to_string(&out)?;
    if !status.success() {
        let errors = std::fs::read_to_string(&err)?;
        let line = errors.lines().find(|line| line.contains("error") || line.contains("panicked"));
        bail!("{status}: {}", line.unwrap_or("without a word").trim());
    }
    let json = serde_json::from_str(&said).context("what was printed is no JSON")?;
    Ok(from_json(&json))
}

/// The answer in the JSON of `explain`.
pub fn from_json(said: &Value) -> Answer {
    let words = |value: &Value| -> Vec<String> {
        value.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
    };
    let recommended = words(&said["recommended"]);
    let groups = recommended
        .iter()
        .map(|id| {
            let mut group = vec![id.clone()];
            group.extend(words(&said["indistinguishable"][id.as_str()]["with"]));
            group
        })
        .collect();
    let last = said["steps"].as_array().and_then(|steps| steps.last()).unwrap_or(&Value::Null);
    let fitted = |p: &Value| {
        Some(Fitted {
            effect: p["effect"].as_str()?.to_owned(),
            name: p["name"].as_str()?.to_owned(),
            value: p["value"].as_f64()?,
            sigma: p["standard_error"].as_f64().unwrap_or(f64::NAN),
        })
    };
    Answer {
        verdict: said["verdict"].as_str().unwrap_or("none").to_owned(),
        recommended,
        groups,
        parameters: said["parameters"].as_array().into_iter().flatten().filter_map(fitted).collect(),
        nuisances: if said["nuisances"].is_null() { String::new() } else { said["nuisances"].to_string() },
        held_out: last["held_out_normalised_rms"].as_f64(),
        held_out_mm: last["held_out_rmse_m"].as_f64().map(|m| m * 1e3),
        lack: said["lack_of_fit"].as_f64(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn the_json_of_explain_becomes_an_answer() {
        let said = json!({
            "verdict": "effect-found",
            "recommended": ["sensor-lag"],
            "indistinguishable": { "sensor-lag": { "with": ["solenoid-lag"], "next_experiment": null } },
            "parameters": [
                { "effect": "sensor-lag", "name": "time_constant", "value": 0.02, "standard_error": 0.001, "unit": "s" },
            ],
            "steps": [{ "step": "datasheet" }, { "step": "sensor-lag", "held_out_rmse_m": 2e-4 }],
            "lack_of_fit": null,
        });
        let answer = from_json(&said);
        assert_eq!(answer.groups, [["sensor-lag", "solenoid-lag"]]);
        assert_eq!((answer.parameters[0].value, answer.held_out_mm), (0.02, Some(0.2)));
    }

    #[cfg(unix)]
    #[test]
    fn a_program_that_fails_or_does_not_end_is_no_answer() {
        let folder = tempfile::tempdir().unwrap();
        let failed = from_program(Path::new("false"), folder.path(), Duration::from_secs(5)).unwrap_err();
        assert!(failed.to_string().contains("without a word"), "{failed}");
        let script = folder.path().join("slow");
        std::fs::write(&script, "#!/bin/sh\nexec sleep 5\n").unwrap();
        let mode = std::os::unix::fs::PermissionsExt::from_mode(0o755);
        std::fs::set_permissions(&script, mode).unwrap();
        let late = from_program(&script, folder.path(), Duration::from_millis(100)).unwrap_err();
        assert!(late.to_string().contains("no answer within"), "{late}");
    }
}
