//! From options to the settings of the estimate.

use std::fs;
use std::path::Path;

use anyhow::Context;
use leak_table::TableBundle;
use prognoser::bayes::{BayesConfig, GrowthLaw, Noise, StartPrior};
use prognoser::{Learned, Method};
use quantity::Quantity;

use super::rows::from_broker;
use crate::cli::{GrowthName, MethodName, PrognoseArgs, StartName, StreamFormat};
use crate::failure::Hinted;
use crate::output::{command, free_name};

/// What gauge pressures beside a log count from, as in the log itself.
const STANDARD_ATMOSPHERE_PA: f64 = 101_325.0;
/// Rounding of a pressure, Pa.
const SLACK_PA: f64 = 10.0;

/// Refuses options that do not go together with where the rows come from.
pub fn check_source(args: &PrognoseArgs) -> anyhow::Result<()> {
    if args.listen.is_some() && !args.follow && !from_broker(args) {
        return Err(Hinted::error(
            format!("--listen: found {}, which is read once, expected a source that goes on", args.log.display()),
            "add --follow, or give the address of a broker",
        ));
    }
    let goes_on = args.follow || args.state.is_some() || args.log == Path::new("-") || from_broker(args);
    if goes_on && !args.columns.is_empty() {
        return Err(Hinted::error(
            "--column and --valve-name: found a source that goes on, expected a log that is read once as a whole",
            "write a log that grows with the columns valve,cycle,close_time_s,open_time_s",
        ));
    }
    if !from_broker(args) {
        return match &args.broker.topic {
            None => Ok(()),
            Some(_) => Err(Hinted::error(
                format!("--topic: found the log {}, expected a broker", args.log.display()),
                "give its address in place of the log, such as mqtt://plant-broker:1883",
            )),
        };
    }
    if args.plot.is_some() {
        return Err(Hinted::error("--plot: a stream from a broker has no end to draw", "leave --plot out"));
    }
    if args.broker.publish.is_some() && args.out.is_some() && args.format != StreamFormat::Jsonl {
        return Err(Hinted::error(
            "--out beside --publish: both get the same rows, expected --format jsonl",
            "add --format jsonl, or leave --out out",
        ));
    }
    Ok(())
}

/// The method with all its settings.
pub fn method(args: &PrognoseArgs, tables: &TableBundle) -> anyhow::Result<Method> {
    if args.method == MethodName::Ols {
        let given = [args.noise.is_some(), args.growth.is_some(), args.life.is_some(), args.prior.is_some()];
        if given.contains(&true) || args.start == StartName::Unknown {
            return Err(Hinted::error(
                "--method ols takes neither noise nor priors",
                "leave --noise, --start, --growth, --life and --prior out, or use --method bayes",
            ));
        }
        if args.expect_supply.is_some() {
            return Err(Hinted::error(
                "--method ols knows no supply pressure",
                "leave --expect-supply out, or use --method bayes",
            ));
        }
        return Ok(Method::Ols);
    }
    let learned = args.prior.as_deref().map(read_prior).transpose()?;
    let config = learned.map_or_else(BayesConfig::default, |learned| learned.config());
    let mut config = BayesConfig {
        risk: args.risk,
        expected_supply_pa: expected_supply_pa(args, tables)?,
        start: match args.start {
            StartName::Healthy => StartPrior::Healthy,
            StartName::Unknown => StartPrior::Unknown,
        },
        ..config
    };
    if let Some(sd_s) = args.noise {
        config.noise = Noise::Known { sd_s };
    }
    if let Some(growth) = args.growth {
        config.growth = match growth {
            GrowthName::Linear => GrowthLaw::Linear,
            GrowthName::Exponential => GrowthLaw::Exponential,
            GrowthName::Auto => GrowthLaw::Auto,
        };
    }
    if let Some(life) = args.life {
        config.life_median_cycles = life;
        config.life_is_stated = true;
    }
    Ok(Method::Bayes(config))
}

/// Whether a valve counts as healthy at its first row.
pub fn begins_healthy(method: &Method) -> bool {
    matches!(method, Method::Bayes(config) if config.start == StartPrior::Healthy)
}

/// The supply pressures that are expected, Pa, if the tables know them.
fn expected_supply_pa(args: &PrognoseArgs, tables: &TableBundle) -> anyhow::Result<Option<[f64; 2]>> {
    let Some(range) = &args.expect_supply else { return Ok(None) };
    let absolute_pa = |end: &Quantity| end.absolute_pa(STANDARD_ATMOSPHERE_PA).context("--expect-supply");
    let [from, to] = [absolute_pa(&range.from)?, absolute_pa(&range.to)?];
    let valve = args.valve.as_ref().map_or_else(|| "VALVE.toml".to_owned(), |path| path.display().to_string());
    let out = free_name(&args.tables.display().to_string());
    let wide = format!(
        "build tables over it and use these:\n{}",
        command(&["build-tables", &valve, "--supply-range", &range.to_string(), "--out", &out]).trim_end()
    );
    let known = tables.condition_range().map(|range| range.supply_pressure_pa).filter(|known| known.0 < known.1);
    let Some((least, most)) = known else {
        return Err(Hinted::error(
            format!("--expect-supply: the tables in {} are for one supply pressure only", args.tables.display()),
            wide,
        ));
    };
    // The tables' own ends, give or take the digits of a file.
    if from < least - SLACK_PA || to > most + SLACK_PA {
        return Err(Hinted::error(
            format!(
                "--expect-supply: found {:.1} to {:.1} kPa absolute, expected a range within that of the tables, \
                 {:.1} to {:.1} kPa",
                1e-3 * from,
                1e-3 * to,
                1e-3 * least,
                1e-3 * most
            ),
            wide,
        ));
    }
    Ok(Some([from, to]))
}

/// Reads what `valve learn` wrote.
pub fn read_prior(path: &Path) -> anyhow::Result<Learned> {
    let text = fs::read_to_string(path).with_context(|| format!("{}: cannot be read", path.display()))?;
    let learned: Learned = toml_edit::de::from_str(&text)
        .with_context(|| format!("{}: is no prior as `valve learn` writes it", path.display()))?;
    learned.checked().with_context(|| path.display().to_string())
}
