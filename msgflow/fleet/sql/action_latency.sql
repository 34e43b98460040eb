-- title: Latency of actions by action and client, of many runs
-- description: As the query action-latency says it of one run. Quantiles of runs cannot be added
--     up: the largest of any run stands for them.
-- grain: one row per action server, client and group of runs
-- column: label_group, action_name, server, client, runs
-- column: goals BIGINT               Goals sent or taken
-- column: accepted, rejected, not_answered, asked, finished, cancelled, doubtful
-- column: overlapping BIGINT         Goals during which the server had another one
-- column: feedback
-- column: accept_median_most_ns BIGINT [ns]  Largest median time from the sending of the goal to
--     the take of the answer
-- column: accept_p99_most_ns BIGINT [ns]     Largest 99 % quantile of these times
-- column: accept_max_ns, result_min_ns
-- column: result_median_most_ns BIGINT [ns]  Largest median of these times
-- column: result_p99_most_ns BIGINT [ns]     Largest 99 % quantile of these times
-- column: result_max_ns, loss_affected
-- brief: action_name, client, result_median_most_ns, result_p99_most_ns, result_max_ns, runs,
--     goals, accepted, rejected, finished, cancelled, server, accept_p99_most_ns, not_answered,
--     doubtful
SELECT
    a.label_group, a.action_name, a.server, a.client,
    count(DISTINCT a.run) AS runs,
    sum(COLUMNS([
        'goals', 'accepted', 'rejected', 'not_answered', 'asked', 'finished', 'cancelled',
        'doubtful', 'overlapping', 'feedback'
    ]))::BIGINT,
    max(a.accept_median_ns) AS accept_median_most_ns,
    max(a.accept_p99_ns) AS accept_p99_most_ns,
    max(a.accept_max_ns) AS accept_max_ns,
    min(a.result_min_ns) AS result_min_ns,
    max(a.result_median_ns) AS result_median_most_ns,
    max(a.result_p99_ns) AS result_p99_most_ns,
    max(a.result_max_ns) AS result_max_ns,
    sum(a.loss_affected)::BIGINT AS loss_affected
FROM action_latency AS a
GROUP BY a.label_group, a.action_name, a.server, a.client
ORDER BY a.action_name, a.server, a.client, a.label_group
