-- description: Corners of the convex hulls of the bounds between two clocks. Each direction has a
--     hull: the lower envelope of the delays. A line fits the clocks if it lies between both hulls
--     and is no steeper than clocks can drift apart. The first step drops each point that another
--     point makes superfluous at every possible drift. The next steps drop each point that does
--     not lie above the line through its neighbours. Times count from `base_ns`, and
--     differences from `base_bound_ns`, which keeps them exact as DOUBLE.
-- grain: one row per pair of clocks, direction and corner
CREATE OR REPLACE MACRO derive.clock_hull(only_run) AS TABLE
WITH RECURSIVE bound AS MATERIALIZED (
    SELECT clock_id, other_clock_id, is_packet, sense, at_ns, bound_ns
    FROM derive.clock_bound(only_run)
),
base AS MATERIALIZED (
    SELECT
        clock_id, other_clock_id,
        min(at_ns) AS base_ns,
        coalesce(max(CASE WHEN sense < 0 THEN bound_ns END), min(-bound_ns)) AS base_bound_ns,
        count(CASE WHEN sense < 0 AND NOT is_packet THEN 1 END) AS received_count,
        count(CASE WHEN sense > 0 AND NOT is_packet THEN 1 END) AS sent_count,
        count(CASE WHEN sense < 0 AND is_packet THEN 1 END) AS received_packet_count,
        count(CASE WHEN sense > 0 AND is_packet THEN 1 END) AS sent_packet_count
    FROM bound
    GROUP BY clock_id, other_clock_id
),
placed AS MATERIALIZED (
    SELECT
        m.clock_id, m.other_clock_id, m.sense,
        (m.at_ns - b.base_ns)::DOUBLE AS moment,
        (m.bound_ns + m.sense * b.base_bound_ns)::DOUBLE AS bound,
        derive.clock_drift_limit() * (m.at_ns - b.base_ns) AS drifted
    FROM bound AS m
    JOIN base AS b ON m.clock_id = b.clock_id AND m.other_clock_id = b.other_clock_id
),
relevant AS (
    SELECT clock_id, other_clock_id, sense, moment, bound
    FROM placed
    QUALIFY coalesce(
        bound + drifted > max(bound + drifted) OVER (
            PARTITION BY clock_id, other_clock_id, sense
            ORDER BY bound - drifted DESC, bound + drifted DESC
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ),
        true
    )
),
thinned (round, clock_id, other_clock_id, sense, moment, bound) AS (
    SELECT 0, clock_id, other_clock_id, sense, moment, bound FROM relevant
    UNION ALL
    SELECT
        round + 1,
        clock_id, other_clock_id, sense, moment, bound
    FROM (
        SELECT
            round, clock_id, other_clock_id, sense, moment, bound, is_above,
            bool_and(is_above) OVER (PARTITION BY clock_id, other_clock_id, sense) AS is_done
        FROM (
            SELECT
                round, clock_id, other_clock_id, sense, moment, bound,
                coalesce(
                    (bound - lag(bound) OVER along) / (moment - lag(moment) OVER along)
                    > (lead(bound) OVER along - bound) / (lead(moment) OVER along - moment),
                    true
                ) AS is_above
            FROM thinned
            WINDOW along AS (PARTITION BY clock_id, other_clock_id, sense ORDER BY moment)
        )
    )
    WHERE is_above AND NOT is_done
),
corner AS (
    SELECT clock_id, other_clock_id, sense, moment, bound
    FROM thinned
    QUALIFY round = max(round) OVER (PARTITION BY clock_id, other_clock_id, sense)
)
SELECT
    c.clock_id, c.other_clock_id, c.sense, c.moment, c.bound, b.base_ns, b.base_bound_ns,
    b.received_count, b.sent_count, b.received_packet_count, b.sent_packet_count
FROM corner AS c
JOIN base AS b ON c.clock_id = b.clock_id AND c.other_clock_id = b.other_clock_id
