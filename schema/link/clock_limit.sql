-- name: derive.clock_limit
-- kind: macro
-- description: What messages told by time, and the clock that stamps them, are taken to be like.
--     All numbers that these rules know are here, each with its reason.
CREATE OR REPLACE MACRO derive.clock_limit() AS {
    -- Long enough for some messages of most topics, short enough that the jumps of a clock cost
    -- little.
    'stretch_ns': 500000000,
    -- A recording of a few seconds needs several stretches too, or a drift would not show.
    'least_stretches': 8,
    -- What a day of recording may cost.
    'most_stretches': 600,
    -- A stretch is longer where messages are few.
    'stretch_messages': 12,
    -- More messages of one stretch do not make its difference of the clocks any sharper.
    'sampled_messages': 48,
    -- A message is of one of so many publications before it was taken, or on either side of its
    -- stamp: several periods, and bursts of a callback.
    'reach': 24,
    -- A thread that is never seen to go on has written its message by then. What takes longer is
    -- expected only of publishers that usually do.
    'write_ns': 5000000,
    -- The shortest delay from a write to its stamp is known better than this. It counts only where
    -- threads go on late: else half of the time in which most stamps may lie is less.
    'slack_ns': 4000,
    -- So many messages do not agree by chance.
    'quorum': 8,
    -- A difference that this share of the best one's messages agrees with may be the right one.
    'rival_share': 0.9,
    -- Where the drift is right, nearly all messages agree; or, if some are of publishers that are
    -- not traced, no other difference has a share as of rivals. Where it is not, each stretch has
    -- its own.
    'sharp_share': 0.95,
    -- Differences less apart than this are within a burst: there the best one is right. Others are
    -- periods apart.
    'burst_ns': 500000,
    -- Clocks of one machine do not drift faster.
    'drift_ppb': 200000,
    -- A drift is the same over so many stretches before and behind.
    'steady_stretches': 5,
    -- So many stretches before and behind vote together, once a vote of fewer has made the drift
    -- known to a few ppm: more messages leave fewer differences.
    'sharp_stretches': 3,
    -- A publisher that writes for less of the time has few messages of others within its writes.
    'writing_share': 0.2,
    -- Of the delays of a publisher: twice what nearly all take, four times what half of them take.
    'usual_quantile': 0.99,
    'usual_factor': 2,
    'median_factor': 4,
    -- A clock explains the messages of some topic; not of every one, as publishers may be missing.
    'explained_share': 0.5
}
