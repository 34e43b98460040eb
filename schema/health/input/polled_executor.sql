-- title: An executor that a loop polls
-- description: Threads ask their executor for work at times of their own. What such a thread does
--     between two polls looks like 'process', the state of looking for what is ready, though it may
--     sleep. What is ready meanwhile waits for the next poll: that time is held_max_ns of a wait,
--     and undecided in paths, since nothing shows when the message came.
-- cause: A loop in the program calls spin_some, or spin_once with a timeout of 0.
-- cure: None needed. Where messages wait for the loop, let the executor spin.
-- grain: one row per process
-- severity: warning
-- when: staging.executor_first WHERE polls > 1
SELECT
    f.process_id,
    sum(f.polls)::BIGINT AS count,
    printf(
        'polled %d times, of %d waits in all', sum(f.polls)::BIGINT, sum(f.waits)::BIGINT
    ) AS detail
FROM staging.executor_first AS f
-- Any program may poll once before it spins.
WHERE f.polls > 1 AND 2 * f.polls > f.waits
GROUP BY f.process_id
