//! The two messages of ROS 2 that cross the border, as plain CDR (XCDR1, little endian).

use ratelab_system::JointValues;

/// Encapsulation: plain CDR, little endian.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// The most bytes of a message that is read, after its encapsulation.
const MOST: usize = 16_380;

/// A time of ROS: seconds and nanoseconds since 1970, or since the start of a simulation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Stamp {
    /// Seconds.
    pub sec: i32,
    /// Nanoseconds beyond those.
    pub nanosec: u32,
}

impl Stamp {
    /// Returns the time `nanos` ns after its zero; the last one for later times.
    pub fn from_nanos(nanos: i64) -> Self {
        const SECOND: i64 = 1_000_000_000;
        Self {
            sec: i32::try_from(nanos.div_euclid(SECOND)).unwrap_or(i32::MAX),
            nanosec: nanos.rem_euclid(SECOND) as u32,
        }
    }
}

/// A `sensor_msgs/msg/JointState`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointState {
    /// When it was sensed.
    pub stamp: Stamp,
    /// The frame, which ratelab leaves empty.
    pub frame_id: String,
    /// Names of the joints.
    pub name: Vec<String>,
    /// Positions (rad or m), velocities (rad/s or m/s), efforts (Nm or N).
    pub values: JointValues,
}

impl JointState {
    /// Returns the bytes of the message.
    pub fn encode(&self) -> Vec<u8> {
        let mut writer = Writer(HEADER.to_vec());
        writer.stamp(self.stamp);
        writer.text(&self.frame_id);
        writer.length(self.name.len());
        self.name.iter().for_each(|name| writer.text(name));
        let JointValues {
            position,
            velocity,
            effort,
        } = &self.values;
        for numbers in [position, velocity, effort] {
            writer.numbers(numbers);
        }
        writer.0
    }

    /// Reads a message from `bytes` of anybody; `None` if they are none.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut reader = CdrReader::new(bytes)?;
        let (stamp, frame_id) = (reader.stamp()?, reader.text()?);
        let count = reader.length(4)?;
        let name = (0..count).map(|_| reader.text()).collect::<Option<_>>()?;
        let message = Self {
            stamp,
            frame_id,
            name,
            values: JointValues {
                position: reader.numbers()?,
                velocity: reader.numbers()?,
                effort: reader.numbers()?,
            },
        };
        reader.ends().then_some(message)
    }
}

/// Returns the bytes of a `rosgraph_msgs/msg/Clock`.
pub fn encode_clock(clock: Stamp) -> Vec<u8> {
    let mut writer = Writer(HEADER.to_vec());
    writer.stamp(clock);
    writer.0
}

struct Writer(Vec<u8>);

impl Writer {
    /// Adds a value at a multiple of its length after the header.
    fn value<const N: usize>(&mut self, value: [u8; N]) {
        let length = (self.0.len() - HEADER.len()).next_multiple_of(N);
        self.0.resize(length + HEADER.len(), 0);
        self.0.extend(value);
    }

    fn length(&mut self, length: usize) {
        let length = u32::try_from(length).unwrap_or(u32::MAX);
        self.value(length.to_le_bytes());
    }

    fn stamp(&mut self, stamp: Stamp) {
        self.value(stamp.sec.to_le_bytes());
        self.value(stamp.nanosec.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.length(numbers.len());
        for number in numbers {
            self.value(number.to_le_bytes());
        }
    }
}

struct CdrReader<'a> {
    /// The bytes after the header.
    bytes: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    fn new(bytes: &'a [u8]) -> Option<Self> {
        let bytes = bytes.strip_prefix(&HEADER)?;
        (bytes.len() <= MOST).then_some(Self { bytes, at: 0 })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..)?.get(..count)?;
        self.at += count;
        Some(taken)
    }

    /// Returns the value at the next multiple of its length.
    fn value<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.at = self.at.next_multiple_of(N);
        self.take(N)?.try_into().ok()
    }

    /// Returns the number of items of at least `size` bytes each that follow: not more than there
    /// are bytes for, whatever the sender claims.
    fn length(&mut self, size: usize) -> Option<usize> {
        let length = u32::from_le_bytes(self.value()?) as usize;
        let room = self.bytes.len().saturating_sub(self.at) / size;
        (length <= room).then_some(length)
    }

    fn stamp(&mut self) -> Option<Stamp> {
        Some(Stamp {
            sec: i32::from_le_bytes(self.value()?),
            nanosec: u32::from_le_bytes(self.value()?),
        })
    }

    fn text(&mut self) -> Option<String> {
        let length = self.length(1)?;
        let (end, text) = self.take(length)?.split_last()?;
        (*end == 0).then(|| String::from_utf8(text.to_vec()).ok())?
    }

    fn numbers(&mut self) -> Option<Vec<f64>> {
        let count = self.length(8)?;
        let number = |_| Some(f64::from_le_bytes(self.value()?));
        (0..count).map(number).collect()
    }

    /// Returns whether nothing but padding is left.
    fn ends(&self) -> bool {
        let rest = self.bytes.get(self.at..).unwrap_or_default();
        rest.len() < 4 && rest.iter().all(|byte| *byte == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hex(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn message(stamp: Stamp, frame: &str, joints: &[&str], values: [&[f64]; 3]) -> JointState {
        let [position, velocity, effort] = values.map(<[f64]>::to_vec);
        JointState {
            stamp,
            frame_id: frame.to_owned(),
            name: joints.iter().map(|&name| name.to_owned()).collect(),
            values: JointValues {
                position,
                velocity,
                effort,
            },
        }
    }

    /// Messages with their bytes by rosbags 0.11.9 (`serialize_cdr`, types of Jazzy).
    fn golden() -> [(JointState, &'static str); 3] {
        let late = Stamp::from_nanos(1_700_000_000_123_456_789);
        let five = Stamp { sec: 5, nanosec: 6 };
        let both: [&[f64]; 3] = [&[0.25, -0.5], &[1.0, -2.0], &[]];
        [
            (
                message(late, "", &["cart", "pole"], both),
                "0001000000f1536515cd5b0701000000000000000200000005000000636172740000000005000000\
                 706f6c650000000002000000000000000000d03f000000000000e0bf020000000000000000000000\
                 0000f03f00000000000000c000000000",
            ),
            (
                message(five, "", &["cart"], [&[], &[], &[-3.5]]),
                "000100000500000006000000010000000000000001000000050000006361727400000000000000000\
                 000000001000000000000000000000000000cc0",
            ),
            (
                message(five, "rail", &["a", "bcd"], [&[1.5], &[], &[-3.5, 2.0]]),
                "000100000500000006000000050000007261696c0000000002000000020000006100000004000000\
                 626364000100000000000000000000000000f83f00000000020000000000000000000cc000000000\
                 00000040",
            ),
        ]
    }

    #[test]
    fn joint_states_are_byte_for_byte_those_of_ros() {
        for (message, bytes) in golden() {
            assert_eq!(hex(&message.encode()), bytes);
            assert_eq!(JointState::decode(&message.encode()), Some(message));
        }
        let clock = Stamp::from_nanos(12_340_000_000);
        assert_eq!(hex(&encode_clock(clock)), "000100000c00000000fd4314");
    }

    #[test]
    fn rubbish_is_refused_and_never_a_panic() {
        let (message, _) = &golden()[0];
        let good = message.encode();
        for length in 0..good.len() {
            assert_eq!(JointState::decode(&good[..length]), None, "{length} bytes");
        }
        for place in 0..good.len() {
            for byte in [0, 1, 0x7f, 0xff] {
                let mut bytes = good.clone();
                bytes[place] = byte;
                let _ = JointState::decode(&bytes);
            }
        }
        let long = [good, vec![0; MOST]].concat();
        assert_eq!(JointState::decode(&long), None);
    }
}
