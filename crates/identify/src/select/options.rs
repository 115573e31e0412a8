//! Numbers that steer a search, each with its reason.

/// Fits of one model from different starts end within 5 to 10 nats of each other, and chance alone gains less than 8: what is
/// nearer than this is neither better nor worse.
pub const BY_CHANCE: f64 = 10.0;

/// Numbers that steer a search.
#[derive(Debug, Clone)]
pub struct SelectOptions {
    /// An effect is accepted from this gain of evidence, nats: [`BY_CHANCE`]. Sets that are no farther apart cannot be told from each
    /// other.
    pub accept: f64,
    /// And when the error on what was held out falls by this share without noise.
    pub held_out_fall: f64,
    /// In the end two effects must leave nothing to be explained, or no more than this share of that error.
    pub nearly_whole: f64,
    /// Effects at most.
    pub most: usize,
    /// Derivatives in the first round of a race, and in the second.
    pub rounds: [usize; 2],
    /// The share of a round that goes on.
    pub kept: f64,
    /// Sets that are fitted to the end, at least.
    pub finalists: usize,
    /// Sets this far behind are not followed, nats, and by so much more as their fits may still gain.
    pub margin: f64,
    /// A fit that goes on may gain so many times what its next step promises, and no more than the best one leaves to be
    /// explained; twice was the most seen where a fit had not fallen into another valley.
    pub optimism: f64,
    /// Sets that are fitted once more from the optimum of the best one, for each of its effects: those that came next to it with
    /// that one exchanged.
    pub rivals: usize,
    /// Sets that are followed to the end, at most.
    pub followed: usize,
    /// Sets whose neighbours, with one effect exchanged, are looked at in the end, at most.
    pub exchanged: usize,
    /// What effects leave counts as nothing where its evidence is below this, nats.
    pub nothing_left: f64,
    /// A model error larger than this is more than instruments and small laws explain (in the units of the rows'
    /// activity): something else is missing. Common position sensors are linear to half a percent of their span.
    pub large: f64,
}

impl Default for SelectOptions {
    fn default() -> Self {
        Self {
            accept: BY_CHANCE,
            held_out_fall: 0.1,
            nearly_whole: 0.1,
            most: 2,
            rounds: [2, 3],
            kept: 0.4,
            finalists: 3,
            margin: 60.0,
            optimism: 3.0,
            rivals: 2,
            followed: 5,
            exchanged: 3,
            nothing_left: 3.0,
            large: 0.005,
        }
    }
}
