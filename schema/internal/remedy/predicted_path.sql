-- title: What changes do to each path
-- description: Latency of each path as it was recorded, and as a replay with changes has it. A gain
--     is shorter by so much than a replay without them.
-- grain: one row per change and path
-- reads: prediction
-- param: place VARCHAR  Only paths that end at this topic or node, a glob; NULL: all
-- column: change VARCHAR  What is changed
-- column: path VARCHAR [path]  The path
-- column: recorded_ns BIGINT [ns]  Median latency, as recorded
-- column: predicted_ns BIGINT [ns]  Less the gain; where no size can be said, as one replay has it
-- column: gain_ns BIGINT [ns]  By how much it is shorter; NULL: no size can be said
-- column: gain_low_ns BIGINT [ns]  Low end of the interval of 90 % of that
-- column: gain_high_ns BIGINT [ns]  High end
-- column: recorded_p95_ns BIGINT [ns]  95 % took no longer, as recorded
-- column: predicted_p95_ns BIGINT [ns]  Likewise less the gain
-- column: p95_gain_ns BIGINT [ns]  By how much it is shorter; NULL: no size can be said
-- column: p95_low_ns BIGINT [ns]  Low end of the interval of 90 % of that
-- column: p95_high_ns BIGINT [ns]  High end
-- column: flows BIGINT  Flows that arrived
-- column: predicted_flows BIGINT  Flows that arrive with the changes
-- column: is_reached BOOLEAN  The changes can reach it
-- column: headline VARCHAR  By how much its latency is shorter; NULL: no size can be said
-- column: doubt VARCHAR  Why no size can be said; NULL: it can
-- brief: path, recorded_ns, predicted_ns, gain_ns, recorded_p95_ns, predicted_p95_ns, p95_gain_ns,
--     doubt, gain_low_ns, gain_high_ns, p95_low_ns, p95_high_ns
SELECT
    change, path, recorded_ns,
    coalesce(recorded_ns - gain_ns, predicted_ns) AS predicted_ns,
    gain_ns,
    low_ns AS gain_low_ns,
    high_ns AS gain_high_ns,
    recorded_p95_ns,
    coalesce(recorded_p95_ns - p95_gain_ns, predicted_p95_ns) AS predicted_p95_ns,
    p95_gain_ns, p95_low_ns, p95_high_ns, flows, predicted_flows, is_reached,
    printf(
        'median %s of %s (%s to %s), p95 %s of %s (%s to %s)',
        main.duration_text(-gain_ns), main.duration_text(recorded_ns),
        main.duration_text(-high_ns), main.duration_text(-low_ns),
        main.duration_text(-p95_gain_ns), main.duration_text(recorded_p95_ns),
        main.duration_text(-p95_high_ns), main.duration_text(-p95_low_ns)
    ) AS headline,
    doubt
FROM prediction
WHERE coalesce(
        string_split(path, ' → ')[-1] GLOB $place OR string_split(path, ' → ')[-2] GLOB $place, true
    )
ORDER BY change, abs(gain_ns) + abs(p95_gain_ns) DESC NULLS LAST, path
