//! What goes wrong around the programs: broken meshes, full disks, interrupts, other processes, too little memory.
#![allow(clippy::unwrap_used, reason = "a failing unwrap fails the test")]

mod broken;
mod corpus;
#[cfg(unix)]
mod faults;
