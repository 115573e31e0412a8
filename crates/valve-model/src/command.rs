//! From commands to what the solenoid does: a list of segments in which its motion is simple.
//!
//! Every edge ends a segment, so that no step of the integrator straddles one and a timing is
//! smooth in every delay.

/// A change of the command.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CommandEdge {
    /// When, s from the start of the run; minus infinity for one that was given long before.
    pub time_s: f64,
    /// Where the spool is told to go: 1 joins the supply (the valve closes), 0 the exhaust (it opens), and in between it
    /// throttles both, as a proportional valve does.
    pub spool: f64,
}

impl CommandEdge {
    /// A solenoid is energised, so that the valve closes, or de-energised.
    pub const fn new(time_s: f64, close: bool) -> Self {
        Self { time_s, spool: if close { 1.0 } else { 0.0 } }
    }

    /// Whether it joins the supply more than the exhaust.
    pub const fn closes(&self) -> bool {
        self.spool > 0.5
    }
}

/// A stretch of time in which the spool rests or travels at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Start, s.
    pub start_s: f64,
    /// End, s.
    pub end_s: f64,
    /// Spool position at the start: 1 joins the supply, 0 the exhaust.
    pub spool: f64,
    /// Spool speed, 1/s.
    pub spool_rate: f64,
    /// When the last command was given, s (minus infinity before the first).
    pub last_command_s: f64,
}

/// Dead times and travel time of the spool, s; zero for the base model.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Solenoid {
    /// Dead time after the command to close, s.
    pub energise_delay_s: f64,
    /// Dead time after the command to open, s.
    pub deenergise_delay_s: f64,
    /// Time of a full travel, s.
    pub travel_time_s: f64,
}

/// When each edge reaches the spool, which begins at `spool`. An edge that would arrive after a later one is
/// lost, and one that changes nothing is none.
fn arrivals(mut spool: f64, commands: &[CommandEdge], solenoid: &Solenoid) -> Vec<CommandEdge> {
    let mut arrived: Vec<CommandEdge> = Vec::with_capacity(commands.len());
    for edge in commands {
        if edge.spool == spool {
            continue;
        }
        let delay = if edge.spool > spool { solenoid.energise_delay_s } else { solenoid.deenergise_delay_s };
        spool = edge.spool;
        let time_s = edge.time_s + delay;
        while arrived.last().is_some_and(|last| last.time_s >= time_s) {
            arrived.pop();
        }
        arrived.push(CommandEdge { time_s, ..*edge });
    }
    arrived
}

/// The segments from 0 to `end_s`, the solenoid vented before the first command. Commands are in order of time;
/// those before 0 were given that long before the start.
pub fn segments(commands: &[CommandEdge], solenoid: &Solenoid, end_s: f64) -> Vec<Segment> {
    segments_after(false, commands, solenoid, end_s)
}

/// As [`segments`], with the solenoid energised before the first command, or vented.
pub fn segments_after(energised: bool, commands: &[CommandEdge], solenoid: &Solenoid, end_s: f64) -> Vec<Segment> {
    let start = if energised { 1.0 } else { 0.0_f64 };
    let arrived = arrivals(start, commands, solenoid);
    let mut breaks: Vec<f64> = commands.iter().chain(&arrived).map(|edge| edge.time_s).collect();
    // Follow the spool to find where it comes to rest.
    let speed = if solenoid.travel_time_s > 0.0 { 1.0 / solenoid.travel_time_s } else { f64::INFINITY };
    let mut legs = vec![(f64::NEG_INFINITY, start, 0.0_f64)];
    for edge in &arrived {
        let (since, from, rate) = legs[legs.len() - 1];
        let target = edge.spool;
        let here = if rate == 0.0 { from } else { (from + rate * (edge.time_s - since)).clamp(0.0, 1.0) };
        if speed.is_infinite() || here == target {
            legs.push((edge.time_s, target, 0.0));
        } else {
            let arrival = edge.time_s + (target - here).abs() / speed;
            // A leg that the next edge cuts short is dropped when that edge is looked at.
            legs.push((edge.time_s, here, speed.copysign(target - here)));
            let next = arrived.iter().find(|other| other.time_s > edge.time_s);
            if next.is_none_or(|other| other.time_s > arrival) {
                legs.push((arrival, target, 0.0));
                breaks.push(arrival);
            }
        }
    }
    breaks.push(0.0);
    breaks.push(end_s);
    breaks.retain(|time| (0.0..=end_s).contains(time));
    breaks.sort_by(f64::total_cmp);
    breaks.dedup();
    breaks
        .windows(2)
        .map(|pair| {
            let (start_s, end_s) = (pair[0], pair[1]);
            let leg = legs.partition_point(|(since, _, _)| *since <= start_s) - 1;
            let (since, from, rate) = legs[leg];
            let spool = if rate == 0.0 { from } else { from + rate * (start_s - since) };
            let given = commands.iter().filter(|edge| edge.time_s <= start_s).map(|edge| edge.time_s);
            Segment { start_s, end_s, spool, spool_rate: rate, last_command_s: given.fold(f64::NEG_INFINITY, f64::max) }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CYCLE: [CommandEdge; 2] = [CommandEdge::new(0.0, true), CommandEdge::new(4.0, false)];

    #[test]
    fn without_lag_the_spool_follows_the_command() {
        let segments = segments(&CYCLE, &Solenoid::default(), 9.0);
        let summary: Vec<_> = segments.iter().map(|s| (s.start_s, s.end_s, s.spool, s.spool_rate)).collect();
        assert_eq!(summary, [(0.0, 4.0, 1.0, 0.0), (4.0, 9.0, 0.0, 0.0)]);
    }

    #[test]
    fn delays_and_travel_make_segments() {
        let lag = Solenoid { energise_delay_s: 0.25, deenergise_delay_s: 0.5, travel_time_s: 0.125 };
        let segments = segments(&CYCLE, &lag, 9.0);
        let summary: Vec<_> = segments.iter().map(|s| (s.start_s, s.spool, s.spool_rate)).collect();
        assert_eq!(
            summary,
            [
                (0.0, 0.0, 0.0),
                (0.25, 0.0, 8.0),
                (0.375, 1.0, 0.0),
                (4.0, 1.0, 0.0),
                (4.5, 1.0, -8.0),
                (4.625, 0.0, 0.0)
            ]
        );
    }

    #[test]
    fn a_solenoid_that_was_energised_waits_for_the_command_to_open() {
        let lag = Solenoid { deenergise_delay_s: 0.5, travel_time_s: 0.25, ..Solenoid::default() };
        let commands = [CommandEdge::new(1.0, false)];
        let segments = segments_after(true, &commands, &lag, 3.0);
        let summary: Vec<_> = segments.iter().map(|s| (s.start_s, s.spool, s.spool_rate)).collect();
        assert_eq!(summary, [(0.0, 1.0, 0.0), (1.0, 1.0, 0.0), (1.5, 1.0, -4.0), (1.75, 0.0, 0.0)]);
    }

    #[test]
    fn a_command_before_the_start_is_on_its_way() {
        let lag = Solenoid { energise_delay_s: 0.25, travel_time_s: 0.5, ..Solenoid::default() };
        let given = |time_s: f64| segments(&[CommandEdge::new(time_s, true)], &lag, 2.0);
        let summary = |segments: Vec<Segment>| -> Vec<_> {
            segments.iter().map(|s| (s.start_s, s.spool, s.spool_rate, s.last_command_s)).collect()
        };
        assert_eq!(summary(given(-0.5)), [(0.0, 0.5, 2.0, -0.5), (0.25, 1.0, 0.0, -0.5)]);
        assert_eq!(summary(given(f64::NEG_INFINITY)), [(0.0, 1.0, 0.0, f64::NEG_INFINITY)]);
    }

    #[test]
    fn a_command_between_both_ends_stops_the_spool_there() {
        let lag = Solenoid { energise_delay_s: 0.25, deenergise_delay_s: 0.5, travel_time_s: 1.0 };
        let commands = [CommandEdge { time_s: 0.0, spool: 0.75 }, CommandEdge { time_s: 2.0, spool: 0.5 }];
        let segments = segments(&commands, &lag, 4.0);
        let summary: Vec<_> = segments.iter().map(|s| (s.start_s, s.spool, s.spool_rate)).collect();
        let rises = [(0.0, 0.0, 0.0), (0.25, 0.0, 1.0), (1.0, 0.75, 0.0)];
        // Towards the exhaust it waits as long as to open.
        assert_eq!(summary, [rises.as_slice(), &[(2.0, 0.75, 0.0), (2.5, 0.75, -1.0), (2.75, 0.5, 0.0)]].concat());
    }

    #[test]
    fn an_edge_during_travel_turns_the_spool_where_it_is() {
        let lag = Solenoid { travel_time_s: 1.0, ..Solenoid::default() };
        let commands = [CommandEdge::new(0.0, true), CommandEdge::new(0.25, false)];
        let segments = segments(&commands, &lag, 2.0);
        let summary: Vec<_> = segments.iter().map(|s| (s.start_s, s.end_s, s.spool, s.spool_rate)).collect();
        assert_eq!(summary, [(0.0, 0.25, 0.0, 1.0), (0.25, 0.5, 0.25, -1.0), (0.5, 2.0, 0.0, 0.0)]);
    }
}
