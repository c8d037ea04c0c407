//! References: accepting results as what later runs are compared with.

mod accept;

pub use accept::{AcceptError, Accepted, accept};
