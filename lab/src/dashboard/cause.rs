//! Why a run was lost, from figures that were measured.
//!
//! Between a reading and the action that it led to lie three periods at the most:
//! the sensor's, the policy's and the actuator's. So readings that old have a slow
//! node on their path, and the slowest is named with the setting that cures it.

use std::time::Duration;

/// What is known of a run that was lost.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Name of the policy that decided at the end.
    pub policy: String,
    /// Whether it balances at any rate.
    pub balances: bool,
    /// Whether the pole fell; otherwise the cart left the rail.
    pub pole_fell: bool,
    /// Age of the oldest reading behind an action of the last second; `None` if
    /// no action was applied in it.
    pub oldest: Option<Duration>,
    /// How often the sensor reads.
    pub sensor: Cadence,
    /// How often the policy decides.
    pub decisions: Cadence,
    /// Period of the actuator, which is fixed.
    pub step: Duration,
    /// How long the policy is made to think.
    pub think: Duration,
    /// How many readings `/obs` keeps.
    pub depth: usize,
    /// Readings lost unread.
    pub dropped: u64,
}

/// How often a node works.
#[derive(Clone, Copy, Debug)]
pub struct Cadence {
    /// One period at its rate.
    pub period: Duration,
    /// Ticks so far.
    pub ticks: u64,
    /// Periods skipped because it was still busy.
    pub overruns: u64,
}

impl Cadence {
    /// Mean time between two ticks, with the periods that were skipped.
    fn interval(&self) -> Duration {
        let periods = self.ticks + self.overruns;
        self.period
            .mul_f64(periods as f64 / self.ticks.max(1) as f64)
    }

    /// Whether overruns keep it from its rate; a few do not.
    fn is_overrun(&self) -> bool {
        self.overruns > self.ticks / 10
    }
}

/// Share of the slowest interval from which on another is as slow.
const AS_SLOW: f64 = 0.9;

impl Facts {
    /// Why it was lost, in short lines: first the cause and its cure.
    pub fn reasons(&self) -> Vec<String> {
        if !self.balances {
            return vec![format!("the {} policy balances at no rate", self.policy)];
        }
        let Some(oldest) = self.oldest else {
            return vec!["no action was applied in the last second".to_owned()];
        };
        // However fast all are, a reading may wait a step for the policy and its
        // action another for the actuator.
        if oldest <= 2 * self.step {
            return vec![format!(
                "data age is not to blame: readings were at most {} old",
                ms(oldest)
            )];
        }
        let mut reasons = self.slow_nodes(oldest);
        let blamed = !reasons.is_empty();
        reasons.push(format!(
            "the last actions used readings up to {} old",
            ms(oldest)
        ));
        if blamed {
            reasons.extend(self.symptom());
        } else {
            reasons.push("no node is that slow any more: the cure came too late".to_owned());
        }
        reasons
    }

    /// The slowest node on the path of readings as old as `oldest`, or both if they
    /// are about as slow; none if they are too fast for that.
    fn slow_nodes(&self, oldest: Duration) -> Vec<String> {
        let slowest = self.sensor.interval().max(self.decisions.interval());
        if 3 * slowest.max(self.step) < oldest {
            return Vec::new();
        }
        let (think, mut slow) = (!self.think.is_zero(), Vec::new());
        let relief = if think {
            "lower --think-ms"
        } else {
            "take a faster policy"
        };
        for (node, cadence, rate, relief) in [
            (
                "the sensor reads",
                &self.sensor,
                "sensor-hz",
                "the machine is too busy",
            ),
            ("the policy decides", &self.decisions, "control-hz", relief),
        ] {
            let (every, overruns) = (cadence.interval(), cadence.overruns);
            if every < slowest.mul_f64(AS_SLOW) {
                continue;
            }
            if cadence.is_overrun() {
                let promised = ms(cadence.period);
                slow.push(format!("{node} every {}, not every {promised}", ms(every)));
                slow.push(format!("{overruns} overruns: {relief}"));
            } else {
                slow.push(format!("{node} every {}: raise {rate}", ms(every)));
            }
        }
        slow
    }

    /// What the queue has to do with a pole that fell to a policy slower than the
    /// sensor.
    fn symptom(&self) -> Option<String> {
        if !self.pole_fell || self.decisions.interval() <= self.sensor.interval() {
            return None;
        }
        let symptom = match (self.dropped, self.depth) {
            (0, 1) => return None,
            (0, depth) => format!("a queue of {depth} hides the symptom"),
            (dropped, _) => format!("{dropped} dropped readings are the symptom"),
        };
        Some(format!("{symptom}, latency is the disease"))
    }
}

fn ms(duration: Duration) -> String {
    format!("{:.0} ms", duration.as_secs_f64() * 1e3)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn millis(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    fn every(period: u64) -> Cadence {
        Cadence {
            period: millis(period),
            ticks: 10,
            overruns: 0,
        }
    }

    /// A pole that fell with everything at 50 Hz but what a case changes.
    fn fell(oldest: u64) -> Facts {
        Facts {
            policy: "scripted".to_owned(),
            balances: true,
            pole_fell: true,
            oldest: Some(millis(oldest)),
            sensor: every(20),
            decisions: every(20),
            step: millis(20),
            think: Duration::ZERO,
            depth: 1,
            dropped: 0,
        }
    }

    fn told(facts: &Facts, expected: &[&str]) {
        assert_eq!(facts.reasons(), expected, "{facts:?}");
    }

    #[test]
    fn a_slow_policy_is_named_with_what_the_queue_shows_of_it() {
        let slow = Facts {
            decisions: every(200),
            ..fell(180)
        };
        let cause = "the policy decides every 200 ms: raise control-hz";
        let age = "the last actions used readings up to 180 ms old";
        let dropped = Facts {
            dropped: 37,
            ..slow.clone()
        };
        told(
            &dropped,
            &[
                cause,
                age,
                "37 dropped readings are the symptom, latency is the disease",
            ],
        );
        let deep = Facts {
            depth: 100,
            ..slow.clone()
        };
        told(
            &deep,
            &[
                cause,
                age,
                "a queue of 100 hides the symptom, latency is the disease",
            ],
        );
        told(&slow, &[cause, age]);
    }

    #[test]
    fn a_slow_sensor_is_named_and_neither_the_policy_nor_the_queue() {
        let slow = Facts {
            sensor: every(200),
            ..fell(180)
        };
        let told_of = [
            "the sensor reads every 200 ms: raise sensor-hz",
            "the last actions used readings up to 180 ms old",
        ];
        told(&slow, &told_of);
        told(
            &Facts {
                depth: 100,
                ..slow.clone()
            },
            &told_of,
        );
        told(&Facts { dropped: 3, ..slow }, &told_of);
    }

    #[test]
    fn a_sensor_and_a_policy_that_are_as_slow_are_both_named() {
        let facts = Facts {
            sensor: every(143),
            decisions: every(143),
            depth: 100,
            ..fell(260)
        };
        told(
            &facts,
            &[
                "the sensor reads every 143 ms: raise sensor-hz",
                "the policy decides every 143 ms: raise control-hz",
                "the last actions used readings up to 260 ms old",
            ],
        );
    }

    #[test]
    fn overruns_count_and_not_the_rate_that_was_set() {
        let overrun = Facts {
            decisions: Cadence {
                ticks: 13,
                overruns: 39,
                ..every(20)
            },
            think: millis(60),
            dropped: 30,
            ..fell(140)
        };
        let cause = "the policy decides every 80 ms, not every 20 ms";
        let age = "the last actions used readings up to 140 ms old";
        let symptom = "30 dropped readings are the symptom, latency is the disease";
        told(
            &overrun,
            &[cause, "39 overruns: lower --think-ms", age, symptom],
        );
        let unasked = Facts {
            think: Duration::ZERO,
            ..overrun
        };
        told(
            &unasked,
            &[cause, "39 overruns: take a faster policy", age, symptom],
        );
    }

    #[test]
    fn a_cart_that_left_the_rail_did_not_fall_to_latency() {
        let facts = Facts {
            policy: "lqr".to_owned(),
            pole_fell: false,
            decisions: every(2_000),
            dropped: 166,
            ..fell(1_980)
        };
        told(
            &facts,
            &[
                "the policy decides every 2000 ms: raise control-hz",
                "the last actions used readings up to 1980 ms old",
            ],
        );
    }

    #[test]
    fn a_node_that_is_fast_again_is_not_blamed() {
        told(
            &fell(180),
            &[
                "the last actions used readings up to 180 ms old",
                "no node is that slow any more: the cure came too late",
            ],
        );
    }

    #[test]
    fn fresh_readings_are_not_blamed() {
        for age in [0, 20, 40] {
            let expected = format!("data age is not to blame: readings were at most {age} ms old");
            told(
                &Facts {
                    dropped: 300,
                    depth: 1,
                    ..fell(age)
                },
                &[&expected],
            );
        }
    }

    #[test]
    fn a_policy_that_does_not_balance_is_named_before_all_else() {
        let facts = Facts {
            policy: "random".to_owned(),
            balances: false,
            decisions: every(200),
            ..fell(180)
        };
        told(&facts, &["the random policy balances at no rate"]);
        let silent = Facts {
            oldest: None,
            ..fell(0)
        };
        told(&silent, &["no action was applied in the last second"]);
    }
}
