//! The model that the sliders say: the valve file with other values and effects.

use std::collections::BTreeMap;

use model_lab::diagnosis::adopt::Addition;
use serde::{Deserialize, Serialize};
use valve_file::ValveFile;
use valve_model::custom::CustomEffect;
use valve_model::{Effect, EffectKind, ParameterId, Valve};

use crate::site::Refusal;

/// An effect with its values, SI, in the order of its parameters; no value is infinity, which JSON has not.
#[derive(Debug, Clone, Deserialize, Serialize)]
pub struct EffectValues {
    /// Id of the catalogue, or name of a custom effect.
    pub name: String,
    /// Its values.
    pub values: Vec<Option<f64>>,
}

/// A model: everything that differs from the valve file on disk, and every effect that is on.
#[derive(Debug, Clone, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Model {
    /// Values of parameters by dotted key, SI; others are those of the file.
    #[serde(default)]
    pub parameters: BTreeMap<String, f64>,
    /// The effects of the catalogue that are on.
    #[serde(default)]
    pub effects: Vec<EffectValues>,
    /// The custom effects of the file that are on.
    #[serde(default)]
    pub custom: Vec<EffectValues>,
}

impl Model {
    /// The model of a valve file as it is.
    pub fn of(file: &ValveFile) -> Self {
        let valve = file.valve();
        let finite = |value: f64| value.is_finite().then_some(value);
        let effects = valve.effects().iter().map(|effect| EffectValues {
            name: effect.kind().id().to_owned(),
            values: effect.values().iter().map(|value| finite(*value)).collect(),
        });
        let custom = valve.custom().iter().map(|effect| EffectValues {
            name: effect.name().to_owned(),
            values: effect.parameters().iter().map(|parameter| finite(parameter.value)).collect(),
        });
        Self { parameters: BTreeMap::new(), effects: effects.collect(), custom: custom.collect() }
    }

    /// The parameters that were named, SI.
    pub fn parameters(&self) -> Result<Vec<(ParameterId, f64)>, Refusal> {
        let id = |key: &str| {
            let found = ParameterId::ALL.iter().copied().find(|id| id.key() == key);
            found.ok_or_else(|| Refusal::new(format!("no parameter is called {key:?}")))
        };
        self.parameters.iter().map(|(key, value)| Ok((id(key)?, *value))).collect()
    }

    /// The effects of the catalogue.
    pub fn effects(&self) -> Result<Vec<Effect>, Refusal> {
        let effect = |one: &EffectValues| {
            let kind = EffectKind::from_id(&one.name)
                .ok_or_else(|| Refusal::new(format!("the catalogue has no effect {:?}", one.name)))?;
            let values: Vec<Option<f64>> =
                one.values.iter().map(|value| Some(value.unwrap_or(f64::INFINITY))).collect();
            Effect::new(kind, &values).map_err(Refusal::new)
        };
        self.effects.iter().map(effect).collect()
    }

    /// The custom effects, which must be in the file.
    pub fn custom(&self, file: &ValveFile) -> Result<Vec<CustomEffect>, Refusal> {
        let effect = |one: &EffectValues| {
            let found = file.valve().custom().iter().find(|effect| effect.name() == one.name);
            let found = found.ok_or_else(|| Refusal::new(format!("the valve file has no effect {:?}", one.name)))?;
            let values: Option<Vec<f64>> = one.values.iter().copied().collect();
            let values = values.filter(|values| values.len() == found.parameters().len());
            let values = values.ok_or_else(|| Refusal::new(format!("{}: a value is missing", one.name)))?;
            Ok(found.with_values(&values))
        };
        self.custom.iter().map(effect).collect()
    }

    /// The valve that it is.
    pub fn valve(&self, file: &ValveFile) -> Result<Valve, Refusal> {
        let mut parameters = file.valve().parameters().clone();
        for (id, value) in self.parameters()? {
            parameters.set(id, value);
        }
        Valve::new(parameters, file.valve().switches(), self.effects()?, self.custom(file)?).map_err(Refusal::new)
    }

    /// The valve file without the effects that are switched off, its values as they are: where a fit begins.
    pub fn without_the_rest(&self, file: &ValveFile) -> Result<ValveFile, Refusal> {
        let mut new = file.clone();
        for effect in file.valve().effects() {
            if self.effects.iter().all(|one| one.name != effect.kind().id()) {
                new = new.without_effect(effect.kind()).map_err(Refusal::new)?;
            }
        }
        for effect in file.valve().custom() {
            if self.custom.iter().all(|one| one.name != effect.name()) {
                new = new.without_custom(effect.name()).map_err(Refusal::new)?;
            }
        }
        Ok(new)
    }

    /// The effects that are on, to be refitted one after the other.
    pub fn additions(&self, file: &ValveFile) -> Result<Vec<Addition>, Refusal> {
        let catalogue = self.effects()?.into_iter().map(|effect| Addition::Catalogue(effect.kind()));
        Ok(catalogue.chain(self.custom(file)?.into_iter().map(Addition::Own)).collect())
    }

    /// The valve file that says this model, its comments, units and order kept.
    pub fn file(&self, file: &ValveFile) -> Result<ValveFile, Refusal> {
        let mut new = self.without_the_rest(file)?;
        new = new.with_parameters(&self.parameters()?).map_err(Refusal::new)?;
        for effect in self.effects()? {
            new = new.with_effect(&effect).map_err(Refusal::new)?;
        }
        for effect in self.custom(file)? {
            new = new.with_custom(&effect).map_err(Refusal::new)?;
        }
        Ok(new)
    }

    /// What it does to the file, in words: "added dry-friction", "calibrated".
    pub fn action(&self, file: &ValveFile) -> String {
        let had = |name: &str| {
            let custom = file.valve().custom().iter().any(|effect| effect.name() == name);
            custom || file.valve().effects().iter().any(|effect| effect.kind().id() == name)
        };
        let on = || self.effects.iter().chain(&self.custom).map(|one| one.name.as_str());
        let added: Vec<&str> = on().filter(|name| !had(name)).collect();
        let valve = file.valve();
        let names = valve.effects().iter().map(|effect| effect.kind().id());
        let names = names.chain(valve.custom().iter().map(CustomEffect::name));
        let removed: Vec<&str> = names.filter(|name| on().all(|one| one != *name)).collect();
        let mut parts = Vec::new();
        if !added.is_empty() {
            parts.push(format!("added {}", added.join(" and ")));
        }
        if !removed.is_empty() {
            parts.push(format!("removed {}", removed.join(" and ")));
        }
        if parts.is_empty() { "set in the lab".to_owned() } else { parts.join(", ") }
    }
}
