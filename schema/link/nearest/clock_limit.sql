-- description: All numbers in the rules about the clock that stamps messages, and about messages
--     that are matched by time; each with its reason.
CREATE OR REPLACE MACRO derive.clock_limit() AS {
    -- So many messages vote together: more would not make the difference of the clocks sharper.
    'stretch_messages': 48,
    -- Unless a recording has few. It needs several stretches, too; else its drift would not show.
    'least_stretches': 8,
    -- About so many stretches are looked at, however long the recording: this bounds the cost.
    'most_stretches': 200,
    -- A message belongs to one of so many publications before its stamp or behind it. That covers
    -- several periods, and bursts of a callback.
    'reach': 24,
    -- A thread that is never seen to go on has written its message after this time. Longer times
    -- are expected only of publishers that usually need them.
    'write_ns': 5000000,
    -- The shortest delay from a write to its stamp is known better than this. It matters only where
    -- threads go on late; elsewhere, half of the interval in which most stamps may lie is less.
    'slack_ns': 4000,
    -- So many messages do not agree by chance.
    'quorum': 8,
    -- A difference that this share of the best one's messages agrees with may be the right one.
    'rival_share': 0.9,
    -- If the drift is right, nearly all messages agree with one difference. If some messages are of
    -- publishers that are not traced, fewer agree, but no other difference is a rival. If the drift
    -- is wrong, each stretch has a difference of its own.
    'sharp_share': 0.95,
    -- Messages of one time agree with one difference, but for lost publications. Of two times with
    -- the same stamps, half of them do.
    'unmixed_share': 0.75,
    -- Two stretches agree with some drift by chance.
    'sharp_stretches': 3,
    -- Differences closer together than this lie within a burst; there the best one is right. Others
    -- are periods apart.
    'burst_ns': 500000,
    -- Clocks of one machine do not drift faster.
    'drift_ppb': 200000,
    -- Nearly all messages of a publisher come so soon after the begin of their write; as many come
    -- no sooner than the others.
    'usual_quantile': 0.99,
    -- Where others publish on the topic, three times what half of the messages take is too late,
    -- and a third of what nearly all take at least is too soon.
    'usual_factor': 3,
    -- The right difference explains at least this share of the messages of some topic. It need not
    -- of every topic: publishers may be missing.
    'explained_share': 0.5
}
