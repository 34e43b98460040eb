-- title: Response time by path, as CARET counts it
-- description: The four response times of CARET. An input that does not arrive is answered by the
--     first output of a later one. The inputs that one output answers are its cycle. 'all' is from
--     every input to its output; 'best' from the newest input of the cycle, 'worst' from the
--     oldest, 'worst-with-external-latency' from the newest input of the cycle before. The earliest
--     output of a path is left out. The time window applies to the input for 'all', else to the
--     newest input of the cycle. CARET measures with --from-event publish --to-event
--     callback_start.
-- grain: one row per path and response time
-- reads: answered_input, named_path
-- param: from, to, from_event, to_event, max_depth, max_paths
-- column: run_id
-- column: response VARCHAR         'all', 'best', 'worst' or 'worst-with-external-latency'
-- column: count BIGINT             Response times: inputs for 'all', else outputs
-- column: ambiguous BIGINT         Those whose output passes a link that may be another one (a
--     candidate_count above 1)
-- column: min_ns BIGINT [ns]       Shortest
-- column: median_ns BIGINT [ns]    Median
-- column: mean_ns BIGINT [ns]      Mean
-- column: p95_ns, p99_ns
-- column: max_ns BIGINT [ns]       Longest
-- column: sink_event, is_cut, path
-- brief: path, response, count, median_ns, p99_ns, max_ns, ambiguous, p95_ns, mean_ns, min_ns
-- note: clocks
WITH cycle AS (
    SELECT
        alike_id, answer_ns,
        min(root_ns) AS oldest_ns,
        max(root_ns) AS newest_ns,
        any_value(sink_event) AS sink_event,
        bool_or(is_ambiguous) AS is_ambiguous
    FROM answered_input
    WHERE answer_ns IS NOT NULL
    GROUP BY alike_id, answer_ns
    QUALIFY row_number() OVER (PARTITION BY alike_id ORDER BY answer_ns) > 1
),
response AS (
    SELECT
        alike_id, sink_event, is_ambiguous,
        newest_ns AS input_ns,
        unnest([
            {response: 'best', response_ns: answer_ns - newest_ns},
            {response: 'worst', response_ns: answer_ns - oldest_ns},
            {
                response: 'worst-with-external-latency',
                response_ns: answer_ns - lag(newest_ns) OVER (
                    PARTITION BY alike_id ORDER BY answer_ns
                )
            }
        ], recursive := true)
    FROM cycle
    UNION ALL
    SELECT
        a.alike_id, a.sink_event, a.is_ambiguous, a.root_ns, 'all',
        a.answer_ns - a.root_ns
    FROM answered_input AS a
    JOIN cycle AS c ON a.alike_id = c.alike_id AND a.answer_ns = c.answer_ns
),
measured AS (
    SELECT
        alike_id, response,
        count(response_ns) AS count,
        count(response_ns) FILTER (WHERE is_ambiguous) AS ambiguous,
        any_value(sink_event) AS sink_event,
        main.spread(response_ns) AS spread
    FROM response
    WHERE input_ns >= $start_ns AND input_ns < $end_ns
    GROUP BY alike_id, response
)
SELECT
    p.run_id, m.response, m.count, m.ambiguous,
    unnest(m.spread),
    m.sink_event, p.is_cut, p.path
FROM named_path AS p
JOIN measured AS m ON p.path_id = m.alike_id
ORDER BY p.run_id, p.path, m.response
