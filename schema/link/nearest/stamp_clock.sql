-- description: How far the clock that stamps messages is from that of the traces. It is constant,
--     or drifts evenly, until it is set: a line for each time between two steps, from the messages
--     of that time alone. A line is certain in stretches of time that agree with it, between others
--     that do: in a stretch beside a step, the clock may have been set already. What most stretches
--     say is found first; then those that do not agree have lines of their own.
-- grain: one row per clock and time in which one line is certain
-- when: derive.unstamped_call
CREATE OR REPLACE MACRO derive.stamp_clock(only_run) AS TABLE
WITH pair AS MATERIALIZED (FROM derive.stamp_pair(only_run)),
stretch AS MATERIALIZED (
    SELECT
        clock_id, stretch,
        median(source_timestamp_ns)::BIGINT AS at_ns,
        min(source_timestamp_ns) AS start_ns,
        max(source_timestamp_ns) AS end_ns,
        avg(is_taken_here::INTEGER) >= 0.5 AS is_taken_here
    FROM pair
    GROUP BY clock_id, stretch
),
region AS MATERIALIZED (
    SELECT r.*, s.at_ns, s.start_ns, s.end_ns
    FROM derive.agreed_difference('pair') AS r
    JOIN stretch AS s ON r.clock_id = s.clock_id AND r.stretch = s.stretch
    WHERE r.most_count >= derive.clock_limit().quorum
),
-- Two stretches in which publications were lost agree with some difference by chance.
lasting AS MATERIALIZED (
    SELECT r.*
    FROM region AS r
    JOIN (
        SELECT clock_id, stretch
        FROM derive.followed_difference('region')
        WINDOW on_clock AS (PARTITION BY clock_id)
        QUALIFY count(*) OVER (PARTITION BY clock_id, segment)
            >= derive.clock_limit().sharp_stretches
            OR segment IN (min(segment) OVER on_clock, max(segment) OVER on_clock)
    ) AS f
        ON r.clock_id = f.clock_id AND r.stretch = f.stretch
),
course AS MATERIALIZED (
    SELECT
        f.clock_id, f.segment, f.stretch, f.difference_ns, r.at_ns, r.start_ns, r.end_ns,
        r.most_count,
        CASE
            WHEN s.is_taken_here THEN f.is_soon
            ELSE f.segment = 0
                OR avg(f.is_alone::INTEGER) OVER (PARTITION BY f.clock_id, f.segment) >= 0.5
        END AS is_told
    FROM derive.followed_difference('lasting') AS f
    JOIN stretch AS s ON f.clock_id = s.clock_id AND f.stretch = s.stretch
    JOIN region AS r
        ON f.clock_id = r.clock_id
        AND f.stretch = r.stretch
        AND f.difference_ns = r.difference_ns
),
judged AS (
    SELECT
        c.*, l.agrees,
        count_if(l.agrees) OVER (
            PARTITION BY c.clock_id ORDER BY c.stretch ROWS UNBOUNDED PRECEDING
        ) AS place
    FROM course AS c
    JOIN derive.stamp_line('pair', 'course') AS l
        ON c.clock_id = l.clock_id AND c.stretch = l.stretch
),
divided AS MATERIALIZED (
    SELECT
        * REPLACE (
            dense_rank() OVER (
                PARTITION BY clock_id ORDER BY segment, CASE WHEN NOT agrees THEN place END
            ) AS segment
        )
    FROM judged
),
told AS (
    SELECT
        d.clock_id, d.segment, d.stretch, d.start_ns, d.end_ns, l.middle_ns, l.difference_ns,
        l.drift_ppb, l.slack_ns,
        l.agrees AND d.is_told AS agrees
    FROM divided AS d
    JOIN derive.stamp_line('pair', 'divided') AS l
        ON d.clock_id = l.clock_id AND d.stretch = l.stretch
),
certain AS (
    SELECT
        *,
        lag(stretch) OVER on_clock IS NULL AS is_first,
        lead(stretch) OVER on_clock IS NULL AS is_last,
        agrees
        AND coalesce(lag(agrees) OVER on_clock AND lag(segment) OVER on_clock = segment, true)
        AND coalesce(lead(agrees) OVER on_clock AND lead(segment) OVER on_clock = segment, true)
            AS is_certain
    FROM told
    WINDOW on_clock AS (PARTITION BY clock_id ORDER BY stretch)
),
run AS (
    SELECT
        *,
        count_if(NOT is_certain) OVER (
            PARTITION BY clock_id ORDER BY stretch ROWS UNBOUNDED PRECEDING
        ) AS place
    FROM certain
)
SELECT
    any_value(only_run)::BIGINT AS run_id,
    clock_id,
    CASE WHEN NOT bool_or(is_first) THEN min(start_ns) END AS start_ns,
    CASE WHEN NOT bool_or(is_last) THEN max(end_ns) END AS end_ns,
    middle_ns AS at_ns,
    difference_ns, drift_ppb, slack_ns
FROM run
WHERE is_certain
GROUP BY clock_id, place, middle_ns, difference_ns, drift_ppb, slack_ns
