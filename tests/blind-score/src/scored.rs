//! An answer beside what is true.

use std::fmt::Write as _;

use blind_benchmark::truth::Truth;
use serde_json::{Value, json};

use crate::answer::Answer;
use crate::wanted::{Kind, Wanted, main_parameter, neutral};

/// A group of effects up to this size still names something.
const LARGEST_GROUP: usize = 3;
/// Half width of a 90 % interval, in standard errors of a normal distribution.
const NINETY: f64 = 1.645;
/// A size is told where it is off by no more than this share, or by two standard errors.
const SIZE_SHARE: f64 = 0.2;

/// What was said of one campaign, beside what is true.
#[derive(Debug, Clone)]
pub struct Scored {
    /// What the answer should be.
    pub wanted: Wanted,
    /// The whole truth of a tidy campaign.
    pub tidy: Option<Truth>,
    /// What was said.
    pub answer: Answer,
    /// Why there was no answer.
    pub failure: Option<String>,
    /// Wall-clock time, s.
    pub seconds: f64,
}

/// How one main size was told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Size {
    /// How far it is off, as a share of its distance from neutral.
    pub error: f64,
    /// The same in standard errors.
    pub pull: f64,
}

impl Size {
    /// Whether the 90 % interval holds the truth.
    pub fn is_covered(self) -> bool {
        self.pull <= NINETY
    }

    /// Whether it is within a fifth or two standard errors.
    pub fn is_told(self) -> bool {
        self.error <= SIZE_SHARE || self.pull <= 2.0
    }
}

impl Scored {
    /// Whether the first effect recommended is one that has to be named.
    pub fn first_is_right(&self) -> bool {
        let first = self.answer.recommended.first();
        first.is_some_and(|first| self.wanted.needed.contains(first) || self.wanted.one_of.contains(first))
    }

    /// Whether every effect that has to be named is in a reported group of at most three.
    pub fn is_in_groups(&self) -> bool {
        let mut groups = self.answer.groups.iter().filter(|group| group.len() <= LARGEST_GROUP);
        let mut named = |id: &String| groups.clone().any(|group| group.contains(id));
        let all = self.wanted.needed.iter().all(&mut named);
        all && (self.wanted.one_of.is_empty()
            || groups.any(|group| group.iter().any(|id| self.wanted.one_of.contains(id))))
    }

    /// Whether every effect that has to be named is recommended.
    pub fn names_all(&self) -> bool {
        let named = |id: &String| self.answer.recommended.contains(id);
        self.wanted.needed.iter().all(named) && (self.wanted.one_of.is_empty() || self.wanted.one_of.iter().any(named))
    }

    /// Whether an effect is recommended that neither is hidden nor may honestly be named.
    pub fn names_wrong(&self) -> bool {
        self.answer.recommended.iter().any(|id| !self.wanted.may_be(id))
    }

    /// Whether just the hidden effects, or what is as good, are recommended.
    pub fn is_exact(&self) -> bool {
        self.names_all() && !self.names_wrong()
    }

    /// Whether it was said that something outside the catalogue is missing.
    pub fn says_outside(&self) -> bool {
        self.answer.verdict == "outside-catalogue"
    }

    /// Whether it was said that something is left.
    pub fn says_left(&self) -> bool {
        self.says_outside() || self.answer.verdict == "partly-explained"
    }

    /// Whether something is named in confidence that is not there, in a group with nothing that is: the worst kind.
    pub fn is_wrong_in_confidence(&self) -> bool {
        let verdict = self.answer.verdict.as_str();
        let claims = verdict == "effect-found" || (verdict == "partly-explained" && self.wanted.kind != Kind::Outside);
        claims && self.answer.groups.iter().any(|group| !group.iter().any(|id| self.wanted.may_be(id)))
    }

    /// Whether something is said to be missing where nothing is hidden.
    pub fn is_false_alarm(&self) -> bool {
        if self.tidy.is_some() {
            return self.wanted.kind == Kind::Nothing && self.answer.verdict != "adequate";
        }
        matches!(self.wanted.kind, Kind::Nothing | Kind::Faint)
            && (self.names_wrong() || (self.says_outside() && !self.wanted.may_be("outside")))
    }

    /// Whether the answer is what was hoped for.
    pub fn is_right(&self) -> bool {
        if self.failure.is_some() {
            return false;
        }
        match self.wanted.kind {
            Kind::Nothing | Kind::Faint => !self.is_false_alarm(),
            Kind::Outside if self.tidy.is_some() => self.says_outside(),
            // An honest alternative that explains everything is as good.
            Kind::Outside => self.says_left() || (!self.answer.recommended.is_empty() && !self.names_wrong()),
            _ if self.wanted.times_only => self.is_in_groups(),
            Kind::One | Kind::Two => self.is_exact(),
        }
    }

    /// How the main sizes of hidden effects that were named were told.
    pub fn sizes(&self) -> Vec<Size> {
        let named = self.answer.recommended.iter();
        named
            .filter_map(|effect| {
                let truth = self.wanted.main_size(effect)?;
                let main = main_parameter(effect)?;
                let found = self.answer.parameters.iter().find(|p| p.effect == *effect && p.name == main)?;
                let off = found.value - truth;
                Some(Size { error: (off / (truth - neutral(effect))).abs(), pull: (off / found.sigma).abs() })
            })
            .collect()
    }

    /// One line for the one who waits.
    pub fn line(&self) -> String {
        let mark = match (self.is_right(), self.is_wrong_in_confidence()) {
            (true, _) => "ok   ",
            (false, true) => "WRONG",
            (false, false) => "miss ",
        };
        let said = self.failure.as_deref().unwrap_or(&self.answer.verdict);
        let groups = self.answer.groups.iter().map(|group| group.join("|")).collect::<Vec<_>>().join(" + ");
        let mut line = format!("{mark} {:46} {said:17} {groups:28}", self.wanted.name);
        if let Some(held_out) = self.answer.held_out {
            let _ = write!(line, " held out {held_out:.2}");
        }
        if let Some(mm) = self.answer.held_out_mm {
            let _ = write!(line, " {mm:.3} mm");
        }
        if let Some(lack) = self.answer.lack {
            let _ = write!(line, " lack {lack:.1}");
        }
        let _ = write!(line, " {:.1} s", self.seconds);
        for p in &self.answer.parameters {
            let _ = write!(line, "  {} {:.3e} +- {:.0e}", p.name, p.value, p.sigma);
        }
        if !self.is_right() {
            let list = |words: &[String]| words.join(",");
            let w = &self.wanted;
            let _ = write!(
                line,
                "  wanted {}: {} one of [{}] allowed [{}]",
                w.kind.word(),
                list(&w.needed),
                list(&w.one_of),
                list(&w.allowed)
            );
        }
        line
    }

    /// All of it for a log.
    pub fn to_json(&self) -> Value {
        let sizes: Vec<Value> =
            self.sizes().iter().map(|size| json!({ "error": size.error, "pull": size.pull })).collect();
        json!({
            "name": self.wanted.name,
            "kind": self.wanted.kind.word(),
            "right": self.is_right(),
            "first_is_right": self.first_is_right(),
            "in_groups": self.is_in_groups(),
            "wrong_in_confidence": self.is_wrong_in_confidence(),
            "verdict": self.answer.verdict,
            "failure": self.failure,
            "groups": self.answer.groups,
            "sizes": sizes,
            "held_out_normalised_rms": self.answer.held_out,
            "held_out_mm": self.answer.held_out_mm,
            "lack": self.answer.lack,
            "nuisances": self.answer.nuisances,
            "seconds": self.seconds,
        })
    }
}
