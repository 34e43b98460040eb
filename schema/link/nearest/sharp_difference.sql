-- description: The difference of two clocks that most messages of some stretches of time allow;
--     the drift brings each message to the middle of one stretch. The difference is sharp, and
--     tells messages apart that were published within microseconds, if nearly all messages allow
--     it or no other difference is a rival.
-- grain: one row per row of the course
-- param: pairs VARCHAR  Name of rows of clock_id, stretch, written_ns, least_ns, greatest_ns
-- param: course VARCHAR  Name of rows of clock_id, place, stretch, at_ns, offset_ns
-- param: reach BIGINT  How many stretches before and behind count too
CREATE OR REPLACE MACRO derive.sharp_difference(pairs, course, reach) AS TABLE
WITH drift AS MATERIALIZED (FROM derive.clock_drift(course)),
allowed AS (
    SELECT
        c.clock_id, c.stretch,
        p.least_ns - round((p.written_ns - c.at_ns) * d.drift_ppb / 1e9)::BIGINT AS least_ns,
        p.greatest_ns - round((p.written_ns - c.at_ns) * d.drift_ppb / 1e9)::BIGINT
            AS greatest_ns
    FROM query_table(course) AS c
    JOIN drift AS d ON c.clock_id = d.clock_id AND c.stretch = d.stretch
    JOIN query_table(course) AS n
        ON c.clock_id = n.clock_id
        AND c.place = n.place
        AND n.stretch BETWEEN c.stretch - reach AND c.stretch + reach
    JOIN query_table(pairs) AS p ON n.clock_id = p.clock_id AND n.stretch = p.stretch
),
-- A stamp counts as one message, also if it has pairs with publications of two publishers.
message AS (
    SELECT
        clock_id, stretch,
        count(DISTINCT written_ns + greatest_ns) AS message_count
    FROM query_table(pairs)
    GROUP BY clock_id, stretch
),
heard AS (
    SELECT
        c.clock_id, c.stretch,
        sum(m.message_count) AS message_count
    FROM query_table(course) AS c
    JOIN query_table(course) AS n
        ON c.clock_id = n.clock_id
        AND c.place = n.place
        AND n.stretch BETWEEN c.stretch - reach AND c.stretch + reach
    JOIN message AS m ON n.clock_id = m.clock_id AND n.stretch = m.stretch
    GROUP BY c.clock_id, c.stretch
),
agreed AS (
    SELECT
        clock_id, stretch,
        max({'votes': vote_count, 'difference_ns': difference_ns}).difference_ns AS difference_ns,
        max(vote_count) AS vote_count,
        count(*) AS region_count
    FROM derive.agreed_difference('allowed')
    WHERE most_count >= derive.clock_limit().quorum
    GROUP BY clock_id, stretch
)
SELECT
    c.clock_id, c.place, c.stretch, c.at_ns,
    coalesce(a.difference_ns, c.offset_ns) AS offset_ns,
    d.drift_ppb,
    coalesce(
        a.vote_count >= derive.clock_limit().sharp_share * h.message_count
        OR a.region_count = 1,
        false
    ) AS is_sharp
FROM query_table(course) AS c
JOIN drift AS d ON c.clock_id = d.clock_id AND c.stretch = d.stretch
LEFT JOIN heard AS h ON c.clock_id = h.clock_id AND c.stretch = h.stretch
LEFT JOIN agreed AS a ON c.clock_id = a.clock_id AND c.stretch = a.stretch
