-- description: All numbers in the rules about the clock that stamps messages, and about messages
--     that are matched by time; each with its reason.
CREATE OR REPLACE MACRO derive.clock_limit() AS {
    -- Long enough for some messages of most topics, short enough that the jumps of a clock cost
    -- little.
    'stretch_ns': 500000000,
    -- A recording of a few seconds needs several stretches, too; else its drift would not show.
    'least_stretches': 8,
    -- At most so many stretches, however long the recording: this bounds the cost.
    'most_stretches': 600,
    -- A stretch is longer where messages are few.
    'stretch_messages': 12,
    -- More messages in one stretch would not make the difference of the clocks any sharper.
    'sampled_messages': 48,
    -- A message belongs to one of so many publications: the last ones before it was taken, or those
    -- on either side of its stamp. That covers several periods, and bursts of a callback.
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
    -- If the clocks stood, one difference explains what the stretches do with one each; if they
    -- drifted by as little as 20 ppm, it explains less, even in bursts.
    'standing_share': 0.99,
    -- Differences closer together than this lie within a burst; there the best one is right. Others
    -- are periods apart.
    'burst_ns': 500000,
    -- Clocks of one machine do not drift faster.
    'drift_ppb': 200000,
    -- A drift stays the same over so many stretches before and after.
    'steady_stretches': 5,
    -- So many stretches before and after vote together. First, fewer of them make the drift known
    -- to a few ppm; then the more messages vote, the fewer differences remain. Nor do clocks stand
    -- for less: in fewer, a constant explains as much as a drift.
    'sharp_stretches': 3,
    -- If a publisher writes for less of the time than this, messages of others come between its
    -- writes as often, and show.
    'writing_share': 0.5,
    -- The limit of the delays of a publisher: twice what nearly all take, or four times what half
    -- of them take. Less than half of what nearly all take at least is unusual, too.
    'usual_quantile': 0.99,
    'usual_factor': 2,
    'median_factor': 4,
    -- The right difference explains at least this share of the messages of some topic. It need not
    -- of every topic: publishers may be missing.
    'explained_share': 0.5
}
