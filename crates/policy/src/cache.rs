//! The files of policies that were loaded.

use std::sync::{Arc, Mutex};

use ratelab::sync::lock;
use ratelab_system::RecordedAnswers;

use crate::{
    LoadedFile, PolicyContext, PolicyError, PolicyFault, PolicyFile, RowPolicy, RowShape,
    program::RecordedPolicy,
};

/// Files of policies in memory, so that a file is read, hashed and parsed only once, before a run
/// begins and outside of a node's thread. Clones share their entries, including later ones.
#[derive(Clone, Debug, Default)]
pub struct PolicyFiles(Arc<Mutex<Vec<(PolicyFile, LoadedFile)>>>);

impl PolicyFiles {
    /// Returns the policy in `file`, after loading it if necessary.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn fetch(&self, file: &PolicyFile) -> Result<LoadedFile, PolicyError> {
        if let Some(loaded) = self.get(file) {
            return Ok(loaded);
        }
        let loaded = file.load()?;
        self.put(file, &loaded);
        self.put(loaded.file(), &loaded);
        Ok(loaded)
    }

    /// Loads `file` with the digest of its current content; one that is pinned stays as it is.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded.
    pub fn pin(&self, file: &PolicyFile) -> Result<LoadedFile, PolicyError> {
        if file.sha256.is_some() {
            return self.fetch(file);
        }
        let loaded = file.load()?;
        self.put(loaded.file(), &loaded);
        Ok(loaded)
    }

    /// Makes the policy in `file`, ready to be asked; returns it with the file, pinned. A program is not
    /// started if its recorded `answers` are given. Of a program that is pinned already the name comes
    /// from a recording, or another log: that alone starts none.
    ///
    /// # Errors
    /// [`PolicyError`] if it cannot be loaded or started, or does not fit.
    pub fn start(
        &self,
        file: &PolicyFile,
        context: PolicyContext,
        shape: RowShape,
        answers: Option<&Arc<RecordedAnswers>>,
    ) -> Result<(Box<dyn RowPolicy>, PolicyFile), PolicyError> {
        if file.is_program {
            if let Some(answers) = answers {
                let count = context.chunk.unwrap_or(1) * shape.width();
                let recorded = RecordedPolicy::new(answers.clone(), count);
                return Ok((Box::new(recorded), file.clone()));
            }
            if !self.knows_program(file) {
                let why = "no recording or log starts a program: name one with this content by its \
                           path alone";
                return Err(PolicyError {
                    spec: file.to_string(),
                    why: Box::new(PolicyFault::Other(why.to_owned())),
                });
            }
        }
        let loaded = self.fetch(file)?;
        let mut policy = loaded.policy(context, shape)?;
        loaded.check_chunk(context.chunk, shape)?;
        policy.start().map_err(|why| loaded.error(why))?;
        Ok((policy, loaded.file().clone()))
    }

    /// Returns whether a program with the content of this pinned one has been loaded, from
    /// wherever.
    fn knows_program(&self, program: &PolicyFile) -> bool {
        let known = lock(&self.0);
        let is_same = |known: &PolicyFile| known.is_program && known.sha256 == program.sha256;
        program.sha256.is_some() && known.iter().any(|(file, _)| is_same(file))
    }

    fn get(&self, file: &PolicyFile) -> Option<LoadedFile> {
        let known = lock(&self.0);
        let found = known.iter().find(|(known, _)| known == file);
        found.map(|(_, loaded)| loaded.clone())
    }

    fn put(&self, file: &PolicyFile, loaded: &LoadedFile) {
        let mut known = lock(&self.0);
        if !known.iter().any(|(known, _)| known == file) {
            known.push((file.clone(), loaded.clone()));
        }
    }
}
