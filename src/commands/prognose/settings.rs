//! From options to the settings of the estimate.

use prognoser::Method;
use prognoser::bayes::{BayesConfig, GrowthLaw, Noise, StartPrior};

use crate::cli::{GrowthName, MethodName, PrognoseArgs, StartName};
use crate::failure::Hinted;

/// The method with all its settings.
pub fn method(args: &PrognoseArgs) -> anyhow::Result<Method> {
    if args.method == MethodName::Ols {
        let given = [args.noise.is_some(), args.growth.is_some(), args.life.is_some()];
        if given.contains(&true) || args.start == StartName::Unknown {
            return Err(Hinted::error(
                "--method ols takes neither noise nor priors",
                "leave --noise, --start, --growth and --life out, or use --method bayes",
            ));
        }
        return Ok(Method::Ols);
    }
    let mut config = BayesConfig {
        start: match args.start {
            StartName::Healthy => StartPrior::Healthy,
            StartName::Unknown => StartPrior::Unknown,
        },
        ..BayesConfig::default()
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
    }
    Ok(Method::Bayes(config))
}
