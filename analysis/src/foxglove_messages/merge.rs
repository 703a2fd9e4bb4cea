//! Merging of message streams by time.

use scenario::time::SimTime;

use super::topics::Message;

/// Messages in order of time.
pub type Stream<'s> = Box<dyn Iterator<Item = anyhow::Result<Message>> + 's>;

/// Merges streams in order of time. Messages with equal times come in the order of the streams. An error is returned at
/// once.
pub fn merge<'s>(
    streams: impl IntoIterator<Item = Stream<'s>>,
) -> impl Iterator<Item = anyhow::Result<Message>> {
    let mut streams: Vec<_> = streams.into_iter().map(Iterator::peekable).collect();
    std::iter::from_fn(move || {
        let time = |next: &anyhow::Result<Message>| {
            next.as_ref()
                .map_or(SimTime::ZERO, |message: &Message| message.at)
        };
        let heads = streams
            .iter_mut()
            .filter_map(|stream| Some((stream.peek().map(time)?, stream)));
        // For equal times, the first stream comes first.
        heads.min_by_key(|(at, _)| *at)?.1.next()
    })
}

#[cfg(test)]
mod tests {
    use anyhow::anyhow;

    use super::*;

    /// Returns messages at these times, identified by the stream's name. An error stands for the time 9.
    fn stream(name: &'static str, times: &'static [u64]) -> Stream<'static> {
        Box::new(times.iter().map(move |at| match at {
            9 => Err(anyhow!("torn")),
            at => Ok(Message {
                at: SimTime(*at),
                channel: 0,
                bytes: name.into(),
            }),
        }))
    }

    fn merged(streams: impl IntoIterator<Item = Stream<'static>>) -> String {
        let all = merge(streams).map(|message| match message {
            Ok(Message { at, bytes, .. }) => format!("{}{}", String::from_utf8_lossy(&bytes), at.0),
            Err(error) => error.to_string(),
        });
        all.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn in_order_of_time_and_of_streams() {
        let streams = [("a", &[1, 4, 4][..]), ("b", &[0, 1, 5]), ("c", &[])];
        let streams = streams.map(|(name, times)| stream(name, times));
        assert_eq!(merged(streams), "b0 a1 b1 a4 a4 b5");
        assert!(merged([]).is_empty());
    }

    #[test]
    fn an_error_is_returned_at_once() {
        let streams = [stream("a", &[1, 8]), stream("b", &[2, 9, 3])];
        assert_eq!(merged(streams), "a1 b2 torn b3 a8");
    }
}
