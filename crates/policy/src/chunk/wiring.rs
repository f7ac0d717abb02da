//! The nodes of a policy that answers with chunks: the policy, and the player.

use ratelab::{Depth, Hz, KnobKind, Match, Topic};
use ratelab_system::{BuildError, Builder};

use super::{
    ActionShape, CHUNK, Chunk, ChunkPlanner, ChunkPolicy, ChunkSettings, PLAYER, PLAYER_STEP,
    POLICY, PlanModel, PlannedPolicy, PlayedAction, Player, REQUEST,
};

/// Why a policy that ticks on request refuses a rate.
const NO_RATE: &str = "refill and control-hz exclude each other: with a refill the policy ticks on \
                       request, and has no rate; leave one of them out";

/// The topics around the two nodes, and how they tick.
pub struct ChunkNodes<'t, R, A> {
    /// The settings of the run.
    pub settings: ChunkSettings,
    /// The names of the numbers of an action.
    pub names: Vec<String>,
    /// The rate of both, unless another one is set for the policy.
    pub rate: Hz,
    /// Why the player has no other rate.
    pub paced: &'static str,
    /// What the policy reads.
    pub observations: &'t Topic<R>,
    /// What the player publishes.
    pub actions: &'t Topic<A>,
}

impl<R: ratelab::Payload, A: PlayedAction> ChunkNodes<'_, R, A> {
    /// The priority of the player: it ticks behind the policy.
    pub const PRIORITY: u32 = 2;

    /// Adds both, with what the policy plans by.
    ///
    /// # Errors
    /// [`BuildError`] for settings that exclude each other.
    pub fn add<M: PlanModel<Reading = R> + 'static>(
        self,
        builder: &mut Builder<'_>,
        policy: impl PlannedPolicy<R> + 'static,
        planner: ChunkPlanner<M>,
    ) -> Result<(), BuildError> {
        let settings = self.settings;
        if settings.refill.is_some() && builder.setup().rate(POLICY).is_some() {
            return Err(BuildError::Setting(NO_RATE.to_owned()));
        }
        let depth = Depth::new(Chunk::DEPTH).unwrap_or(Depth::MAX);
        let chunks = Topic::new(CHUNK, builder.setup().depth(CHUNK).unwrap_or(depth));
        let count = settings.horizon.get() * self.names.len();
        let actions = self.names.iter().map(String::as_str).cycle().take(count);
        builder.record_as(chunks.clone(), Chunk::HEAD.into_iter().chain(actions));
        let (requests, release) = match settings.refill {
            Some(_) => (builder.topic(REQUEST), Match::Each.into()),
            None => (builder.internal_topic(REQUEST), self.rate.into()),
        };
        builder.single_node(POLICY, release, 1, |wiring| ChunkPolicy {
            policy,
            planner,
            last_tick: wiring.last_tick(),
            observations: wiring.subscription(self.observations),
            chunks: wiring.publisher(&chunks),
            requests: settings.refill.map(|_| wiring.trigger(&requests)),
        })?;
        let steps = builder.topic(PLAYER_STEP);
        let chunks = builder.through(&chunks, 1)?;
        builder.single_node(PLAYER, self.rate.into(), Self::PRIORITY, |wiring| {
            wiring.fix([KnobKind::Rate], self.paced);
            Player::new(
                &settings,
                wiring.subscription(&chunks),
                wiring.publisher(self.actions),
                wiring.publisher(&steps),
                settings.refill.map(|_| wiring.publisher(&requests)),
            )
        })
    }
}

impl ChunkSettings {
    /// Takes the settings of a run that is built, if its policy answers with chunks; `own` are
    /// parameters of the policy that count for chunks only.
    ///
    /// # Errors
    /// [`BuildError`] for an invalid value, and for settings of chunks without any.
    pub fn take(
        builder: &mut Builder<'_>,
        of: ActionShape,
        own: &[&'static str],
    ) -> Result<Option<Self>, BuildError> {
        let mut set = Vec::new();
        let shared = Self::PARAMETERS.map(|(node, name, _)| (node, name));
        let of_policy = own.iter().map(|name| (POLICY, *name));
        for (node, name) in shared.into_iter().chain(of_policy) {
            set.extend(builder.parameter(node, name).map(|_| name));
        }
        match set.first() {
            Some(name) if !set.contains(&Self::CHUNK) => Err(BuildError::Setting(format!(
                "--{name} is for a policy that answers with chunks: give --chunk H as well"
            ))),
            _ => Self::from_setup(builder.setup(), of)
                .map_err(|error| BuildError::Setting(error.to_string())),
        }
    }
}
