//! MuJoCo's library, which the workspace needs before cargo can link it.
//!
//! The build script of the cart-pole calls this crate, so a plain `cargo build` sets itself up;
//! `cargo xtask setup` does the same as an explicit step. There are no dependencies, so
//! that step compiles in a second and works without MuJoCo.

pub mod mujoco;
