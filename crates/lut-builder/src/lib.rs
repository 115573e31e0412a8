//! Sweeps the leak area through the model and builds leak tables
