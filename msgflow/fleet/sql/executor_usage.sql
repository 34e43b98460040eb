-- title: What executor threads spent their time on, of many runs
-- description: As the query executor-usage says it of one run; threads of one process and kind of
--     executor are put together. The callback share is the share of all their time.
-- grain: one row per host, process, kind of executor and group of runs
-- column: label_group, host, process, executor_kind, runs
-- column: threads BIGINT            Threads of all these runs
-- column: seen_ns BIGINT [ns]       Time for which threads were seen
-- column: wait_ns BIGINT [ns]       Waiting for work
-- column: select_ns BIGINT [ns]     Looking for what is ready
-- column: take_ns
-- column: callback_ns BIGINT [ns]   In callbacks, services included; nested time counts once
-- column: blocked_ns BIGINT [ns]    Waiting for the lock of a multi-threaded executor after a
--     callback
-- column: unknown_ns BIGINT [ns]    Not known
-- column: callbacks, callback_share
-- column: callback_share_max DOUBLE [share] The same of the busiest thread of any run
-- brief: process, callback_share, callback_share_max, runs, threads, callback_ns, blocked_ns,
--     wait_ns, callbacks, host, select_ns, take_ns, seen_ns, unknown_ns, executor_kind
SELECT
    u.label_group, u.host, u.process, u.executor_kind,
    count(DISTINCT u.run) AS runs,
    count(*) AS threads,
    sum(COLUMNS([
        'seen_ns', 'wait_ns', 'select_ns', 'take_ns', 'callback_ns', 'blocked_ns', 'unknown_ns',
        'callbacks'
    ]))::BIGINT,
    sum(u.callback_ns) / nullif(sum(u.seen_ns), 0)::DOUBLE AS callback_share,
    max(u.callback_share) AS callback_share_max
FROM executor_usage AS u
GROUP BY u.label_group, u.host, u.process, u.executor_kind
ORDER BY u.host, u.process, u.executor_kind, u.label_group
