//! The program from outside: what it prints, the whole chain, the documents.

mod architecture;
mod broker;
mod calibrate;
mod campaign;
mod chain;
mod cli;
mod compare;
mod dice;
mod docs;
mod error;
mod explain;
mod fleet;
mod init;
mod kills;
mod lab;
mod logs;
mod manners;
mod mosquitto;
mod next;
mod outputs;
mod page;
mod report_page;
mod state;
mod support;
mod unattended;
mod watch;
