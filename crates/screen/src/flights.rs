//! Positions of messages in flight on a link.

use std::collections::VecDeque;

use ratelab::Time;
use ratelab_account::Flight;

use super::frame::Dot;

/// Position of a lost message (share of the way).
const LOST_AT: f64 = 0.5;

/// The messages in flight at run time `now`; `None` for a link without delay. A lost
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

    fn ms(ms: u64) -> Time {
        Time::from_nanos(ms * 1_000_000)
    }

    fn flight(released: u64, arrives: Option<u64>) -> Flight {
        Flight {
            released: ms(released),
            arrives: arrives.map(ms),
        }
    }

    #[test]
    fn a_dot_is_on_its_way_for_as_long_as_its_message() {
        let flights = [flight(0, Some(40)), flight(20, Some(60))];
        let ways = |now| -> Vec<f64> {
            let dots = dots(&flights.into(), ms(now)).expect("a delay");
            dots.iter().map(|dot| dot.way).collect()
        };
        assert_eq!(ways(10), [0.25]);
        assert_eq!(ways(30), [0.75, 0.25]);
        assert_eq!(ways(40), [0.5]);
        assert!(ways(60).is_empty());
    }

    #[test]
    fn a_lost_message_ends_half_way() {
        let flights = [flight(0, Some(40)), flight(100, None)];
        let dot = |now| {
            dots(&flights.into(), ms(now))
                .expect("a delay")
                .first()
                .copied()
        };
        assert_eq!(
            dot(110),
            Some(Dot {
                way: 0.25,
                lost: false
            })
        );
        assert_eq!(
            dot(135),
            Some(Dot {
                way: LOST_AT,
                lost: true
            })
        );
        assert_eq!(dot(140), None);
    }

    #[test]
    fn a_link_that_takes_no_time_has_no_dots_of_its_own() {
        assert_eq!(dots(&[].into(), ms(9)), None);
        assert_eq!(
            dots(&[flight(0, None), flight(5, Some(5))].into(), ms(9)),
            None
        );
    }
}
