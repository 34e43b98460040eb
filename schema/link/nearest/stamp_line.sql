-- description: One difference and one drift for each segment of the course of a clock: those that
--     most of its messages allow. The clocks of one boot run at one rate (clock_gettime(2)), so no
--     drift is tried too. A stretch agrees with the line if the line explains nearly as many of its
--     messages as any difference does. Where other differences explain nearly as many messages of
--     the segment, the slack reaches to the farthest of them. Where no drift explains half of
--     the time, the clock may have been set by a little in place of it.
-- grain: one row per row of the course
-- param: pairs VARCHAR  Name of rows as of derive.stamp_pair
-- param: course VARCHAR  Name of rows of clock_id, segment, stretch, at_ns, difference_ns,
--     most_count
CREATE OR REPLACE MACRO derive.stamp_line(pairs, course) AS TABLE
WITH drift AS (FROM derive.clock_drift(course)),
trial AS (
    SELECT
        clock_id, segment, middle_ns, 0 AS drift_ppb,
        2 * segment AS place
    FROM drift
    UNION ALL
    SELECT
        clock_id, segment, middle_ns, drift_ppb,
        2 * segment + 1
    FROM drift
),
allowed AS MATERIALIZED (
    SELECT
        c.clock_id,
        c.stretch AS of_stretch,
        p.source_timestamp_ns,
        t.place AS stretch,
        p.least_ns - ((p.source_timestamp_ns - t.middle_ns) * t.drift_ppb / 1e9)::BIGINT
            AS least_ns,
        p.greatest_ns - ((p.source_timestamp_ns - t.middle_ns) * t.drift_ppb / 1e9)::BIGINT
            AS greatest_ns
    FROM query_table(course) AS c
    JOIN trial AS t ON c.clock_id = t.clock_id AND c.segment = t.segment
    JOIN query_table(pairs) AS p
        ON c.clock_id = p.clock_id
        AND c.stretch = p.stretch
        AND p.least_ns <= c.difference_ns + derive.clock_limit().burst_ns
        AND p.greatest_ns >= c.difference_ns - derive.clock_limit().burst_ns
),
message AS (
    SELECT
        clock_id,
        stretch AS place,
        count(DISTINCT source_timestamp_ns) AS message_count,
        count(DISTINCT of_stretch) AS stretch_count
    FROM allowed
    GROUP BY clock_id, stretch
),
line AS MATERIALIZED (
    SELECT
        a.clock_id, t.segment, t.place, t.middle_ns, t.drift_ppb,
        max(a.vote_count) AS vote_count,
        arg_max(a.difference_ns, (a.vote_count, a.difference_ns)) AS difference_ns,
        CASE
            WHEN any_value(m.stretch_count) < derive.clock_limit().sharp_stretches
                THEN derive.clock_limit().burst_ns
            WHEN count(*) > 1
                AND max(a.vote_count)
                < derive.clock_limit().sharp_share * any_value(m.message_count)
                THEN max(a.greatest_ns) - min(a.least_ns)
            ELSE 0
        END AS slack_ns
    FROM derive.agreed_difference('allowed', derive.clock_limit().rival_share) AS a
    JOIN trial AS t ON a.clock_id = t.clock_id AND a.stretch = t.place
    JOIN message AS m ON a.clock_id = m.clock_id AND a.stretch = m.place
    GROUP BY a.clock_id, t.segment, t.place, t.middle_ns, t.drift_ppb
),
judged AS (
    SELECT
        c.clock_id, c.stretch, l.segment, l.place,
        any_value(c.at_ns) AS at_ns,
        count_if(l.difference_ns BETWEEN a.least_ns AND a.greatest_ns)
        >= floor(derive.clock_limit().rival_share * any_value(c.most_count)) AS agrees
    FROM query_table(course) AS c
    JOIN line AS l ON c.clock_id = l.clock_id AND c.segment = l.segment
    JOIN allowed AS a
        ON c.clock_id = a.clock_id AND l.place = a.stretch AND c.stretch = a.of_stretch
    GROUP BY c.clock_id, c.stretch, l.segment, l.place
),
chosen AS (
    SELECT
        j.clock_id,
        arg_max(j.place, (j.agreeing_count, l.vote_count, -j.place)) AS place,
        any_value(j.duration_ns) AS duration_ns,
        2 * max(j.agreeing_count) FILTER (l.drift_ppb = 0) >= any_value(j.stretch_count)
            AS may_be_set
    FROM (
        SELECT
            clock_id, segment, place,
            count(*) AS stretch_count,
            count_if(agrees) AS agreeing_count,
            max(at_ns) - min(at_ns) AS duration_ns
        FROM judged
        GROUP BY clock_id, segment, place
    ) AS j
    JOIN line AS l ON j.clock_id = l.clock_id AND j.place = l.place
    GROUP BY j.clock_id, j.segment
)
SELECT
    j.clock_id, j.segment, j.stretch,
    j.agrees OR coalesce(lag(j.agrees) OVER in_order AND lead(j.agrees) OVER in_order, false)
        AS agrees,
    l.middle_ns, l.difference_ns, l.drift_ppb,
    CASE
        WHEN c.may_be_set
            THEN greatest(l.slack_ns, (c.duration_ns * abs(l.drift_ppb) / 1e9)::BIGINT)
        ELSE l.slack_ns
    END AS slack_ns
FROM chosen AS c
JOIN line AS l ON c.clock_id = l.clock_id AND c.place = l.place
JOIN judged AS j ON c.clock_id = j.clock_id AND c.place = j.place
WINDOW in_order AS (PARTITION BY j.clock_id, j.segment ORDER BY j.stretch)
