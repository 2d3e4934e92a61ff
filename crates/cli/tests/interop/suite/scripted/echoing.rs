//! Echo of test messages of any size by a scripted peer.

use std::time::{Duration, Instant};

use super::asking::Asker;
use super::body;
use super::speaker::{Heard, Speaker};

/// Size of the message by which both sides learn each other's address, in octets.
const GREETING: usize = 16;
/// Time without an answer after which a possibly lost message is sent again.
const AGAIN: Duration = Duration::from_secs(2);
/// Interval of the messages of [`Asker::keep_echo`].
const BEAT: Duration = Duration::from_millis(200);
/// Longer than any wait.
const FOR_EVER: Duration = Duration::from_secs(3600);

/// Sends every test message back unchanged.
pub(super) fn echo(mut speaker: Speaker) -> Result<(), String> {
    println!("listening");
    loop {
        let Some(Heard { source, payload }) = speaker.hear(Instant::now() + FOR_EVER) else {
            continue;
        };
        if body::code(&payload) == Some(body::TEST) {
            println!("{} octets from {source}", payload.len());
            speaker.say(source, &payload);
        }
    }
}

impl Asker {
    /// Sends a message, and expects it back unchanged.
    pub(super) fn send(&mut self, size: usize, is_acknowledged: bool) -> Result<(), String> {
        self.there_and_back(GREETING, false)?;
        self.there_and_back(size, is_acknowledged)?;
        println!("{size} octets there and back");
        Ok(())
    }

    fn there_and_back(&mut self, size: usize, is_acknowledged: bool) -> Result<(), String> {
        let message = body::test(size);
        while Instant::now() < self.deadline {
            if is_acknowledged {
                self.speaker.assure(self.other, &message)?;
            } else {
                self.speaker.say(self.other, &message);
            }
            if self.returns(&message)? {
                return Ok(());
            }
            println!("nothing came back yet");
        }
        Err(format!("{size} octets did not come back"))
    }

    fn returns(&mut self, message: &[u8]) -> Result<bool, String> {
        let deadline = Instant::now() + AGAIN;
        while let Some(heard) = self.speaker.hear(deadline) {
            if heard.source == self.other && heard.payload.len() == message.len() {
                let is_same = heard.payload == message;
                return is_same
                    .then_some(true)
                    .ok_or("what came back is not the same".to_owned());
            }
        }
        Ok(false)
    }

    /// Sends a message again and again, and prints each echo.
    pub(super) fn keep_echo(&mut self) -> Result<(), String> {
        let message = body::test(GREETING);
        loop {
            self.speaker.say(self.other, &message);
            if self.returns(&message)? {
                println!("report: it came back");
            }
            std::thread::sleep(BEAT);
        }
    }
}
