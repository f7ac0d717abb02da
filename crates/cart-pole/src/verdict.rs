//! The verdicts of the cart-pole.

use ratelab_system::VerdictKind;

/// The pole was up for the whole run.
pub const BALANCED: VerdictKind = VerdictKind::held("balanced", "BALANCED (pole up the whole run)");
/// The run ended before the first step of the plant.
pub const NEVER_MOVED: VerdictKind =
    VerdictKind::lost("never_moved", "UNDECIDED (the plant never moved)");
/// The pole was up when a command stopped the run.
pub const STOPPED: VerdictKind = VerdictKind::held("stopped", "STOPPED at {at} (pole up so far)");
/// The pole tipped beyond its limit.
pub const POLE_FELL: VerdictKind =
    VerdictKind::lost("pole_fell", "FELL at {at} (pole beyond ±12°)");
/// The cart left the rail with the pole still up.
pub const CART_LEFT_RAIL: VerdictKind = VerdictKind::lost(
    "cart_left_rail",
    "LEFT THE RAIL at {at} (cart beyond ±2.4 m, pole still up)",
);

/// All of them, that of a successful run first.
pub(crate) const ALL: [VerdictKind; 5] =
    [BALANCED, STOPPED, POLE_FELL, CART_LEFT_RAIL, NEVER_MOVED];
