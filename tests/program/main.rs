//! The program from outside: what it prints, the whole chain, the documents.

mod architecture;
mod chain;
mod cli;
mod docs;
mod support;
