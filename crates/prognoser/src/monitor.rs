//! Do the residuals of a valve behave like noise?
//!
//! Noise changes its sign from cycle to cycle, a misfit does not. The mean
//! square of successive differences (von Neumann 1941) sees only the noise;
//! the mean sees only the misfit.

use leak_table::{Fault, Stroke};

use crate::notice::Notice;

/// Weight of the newest residual in the running means, once there are enough.
const NEWEST: f64 = 0.05;
/// Residuals before anything is said.
const ENOUGH: f64 = 10.0;
/// Standard errors of the mean from which on an offset counts.
const SIGNIFICANT: f64 = 6.0;
/// Offsets below this share of the healthy stroke time are never mentioned:
/// no table is better.
const SMALLEST: f64 = 0.01;

#[derive(Clone, Copy, Debug, Default)]
struct Running {
    n: f64,
    mean: f64,
    square: f64,
    difference: f64,
    last: Option<f64>,
}

impl Running {
    fn add(&mut self, residual: f64) {
        self.n += 1.0;
        let weight = NEWEST.max(1.0 / self.n);
        self.mean += weight * (residual - self.mean);
        self.square += weight * (residual * residual - self.square);
        if let Some(last) = self.last {
            let half = 0.5 * (residual - last).powi(2);
            let weight = NEWEST.max(1.0 / (self.n - 1.0));
            self.difference += weight * (half - self.difference);
        }
        self.last = Some(residual);
    }

    /// The mean, if it is more than noise.
    fn offset(&self, smallest_s: f64) -> Option<f64> {
        let effective = self.n.min(2.0 / NEWEST);
        let error = (self.difference / effective).sqrt();
        let real = self.n >= ENOUGH && self.mean.abs() > (SIGNIFICANT * error).max(smallest_s);
        real.then_some(self.mean)
    }
}

/// Watches the residuals of one valve. Each remark is made once, until the
/// estimate starts anew.
#[derive(Clone, Debug, Default)]
pub(crate) struct Monitor {
    strokes: [Running; 2],
    offset_said: [bool; 2],
    unexplained_said: bool,
    noise_said: bool,
}

impl Monitor {
    /// Takes in the residuals of a cycle (in s; none for glitches and strokes
    /// that did not finish) and says what is odd about them. The times of the
    /// healthy valve say what is a trifle.
    pub(crate) fn look(
        &mut self,
        residual_s: [Option<f64>; 2],
        healthy_s: [f64; 2],
        stated_sd_s: Option<f64>,
        best: Fault,
        notices: &mut Vec<Notice>,
    ) {
        for (running, residual) in self.strokes.iter_mut().zip(residual_s) {
            if let Some(residual) = residual {
                running.add(residual);
            }
        }
        let smallest_s = healthy_s.map(|time| SMALLEST * time);
        let offsets = [0, 1].map(|i| self.strokes[i].offset(smallest_s[i]));
        for (i, stroke) in Stroke::ALL.into_iter().enumerate() {
            if let (Some(offset_s), false) = (offsets[i], self.offset_said[i]) {
                self.offset_said[i] = true;
                notices.push(Notice::Offset { stroke, offset_s });
            }
        }
        // Far more scatter than from one cycle to the next: a slow misfit.
        let misfit = |i: usize| {
            let running = &self.strokes[i];
            let trifle = smallest_s[i] * smallest_s[i];
            running.n >= ENOUGH && running.square > 6.0 * running.difference + trifle
        };
        if !self.unexplained_said && misfit(0) && misfit(1) {
            self.unexplained_said = true;
            notices.push(Notice::Unexplained { best });
        }
        if let (Some(stated_s), false) = (stated_sd_s, self.noise_said) {
            let found = 0.5 * (self.strokes[0].difference + self.strokes[1].difference);
            let n = self.strokes[0].n.min(2.0 / NEWEST);
            // The relative error of a variance from 2 n differences is about
            // sqrt(3 / 2 n).
            let excess = found / (stated_s * stated_s) - 1.0;
            if n >= ENOUGH && excess > 4.0 * (1.5 / n).sqrt() {
                self.noise_said = true;
                notices.push(Notice::NoiseLarger { stated_s, found_s: found.sqrt() });
            }
        }
    }
}
