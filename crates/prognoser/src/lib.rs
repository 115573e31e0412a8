//! Timing logs and leak tables to fault, leak, end of life and remaining useful life
