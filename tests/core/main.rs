//! The core, through what it offers: one program, so that what its parts share is compiled once.

mod allocation;
mod averages;
mod batch;
mod counting;
mod duals;
mod effects;
mod either;
mod elementary;
mod estimate;
mod event_location;
mod formulas;
mod order;
mod own_packets;
mod saltation;
mod section;
mod states;
mod stick;
mod tape;
