//! Positions of messages in flight on a link.

use std::collections::VecDeque;

use ratelab::Time;
use ratelab_metrics::Flight;

use super::frame::Dot;

/// Position of a lost message (share of the way).
const LOST_AT: f64 = 0.5;

/// Returns the messages in flight at run time `now`; `None` for a link without delay. A lost
/// message goes half the way and stays there for the other half of its time.
pub fn dots(flights: &VecDeque<Flight>, now: Time) -> Option<Vec<Dot>> {
    let took = |flight: &Flight| Some(flight.arrives?.since(flight.released));
    let usual = flights
        .iter()
        .rev()
        .filter_map(took)
        .find(|took| !took.is_zero())?;
    let dots = flights.iter().filter_map(|flight| {
        let took = took(flight).unwrap_or(usual);
        let (end, passed) = (flight.released + took, now.since(flight.released));
        let under_way = flight.released <= now && now < end;
        let way = passed.as_secs_f64() / took.as_secs_f64();
        let lost = flight.arrives.is_none() && way >= LOST_AT;
        under_way.then_some(Dot {
            way: if lost { LOST_AT } else { way },
            lost,
        })
    });
    Some(dots.collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Release and arrival of a message (ms).
    type Sample = (u64, Option<u64>);

    #[test]
    fn a_dot_is_on_its_way_as_long_as_its_message_and_a_lost_one_ends_half_way() {
        const BOTH: &[Sample] = &[(0, Some(40)), (20, Some(60))];
        const LOST: &[Sample] = &[(0, Some(40)), (100, None)];
        let ms = |ms: u64| Time::from_nanos(ms * 1_000_000);
        for (flights, now, expected) in [
            (BOTH, 10, Some(&[(0.25, false)][..])),
            (BOTH, 30, Some(&[(0.75, false), (0.25, false)])),
            (BOTH, 40, Some(&[(0.5, false)])),
            (BOTH, 60, Some(&[])),
            (LOST, 110, Some(&[(0.25, false)])),
            (LOST, 135, Some(&[(LOST_AT, true)])),
            (LOST, 140, Some(&[])),
            // A link that takes no time has no dots of its own.
            (&[], 9, None),
            (&[(0, None), (5, Some(5))], 9, None),
        ] {
            let flights = flights.iter().map(|(released, arrives)| Flight {
                released: ms(*released),
                arrives: arrives.map(ms),
            });
            let dots = dots(&flights.collect(), ms(now));
            let found: Option<Vec<_>> =
                dots.map(|dots| dots.iter().map(|dot| (dot.way, dot.lost)).collect());
            assert_eq!(found, expected.map(<[_]>::to_vec), "{now} ms");
        }
    }
}
