-- How many reasons were excused because events are missing, and how many may be. A hole of length d
-- meets the time from a message to the next one where it falls in d, or in the one time between two
-- messages before it. So if holes cover the share c of a host with n pairs of messages and
-- subscriptions, about n·c are excused, and one more of each publisher and subscription for each
-- hole; twice as many are allowed, since messages come in bursts. Without a hole none is allowed.
CREATE OR REPLACE TEMP TABLE excused AS
WITH span AS (
    SELECT host, min(ts_ns) AS first_ns, max(ts_ns) AS last_ns
    FROM truth_recorded
    GROUP BY host
),
clipped AS (
    SELECT
        h.host, greatest(h.begin_ns, s.first_ns) AS begin_ns, least(h.end_ns, s.last_ns) AS end_ns,
        s.last_ns - s.first_ns AS length_ns
    FROM truth_hole AS h
    JOIN span AS s ON h.host = s.host
),
reached AS (
    SELECT
        *,
        max(end_ns) OVER (
            PARTITION BY host ORDER BY begin_ns, end_ns
            ROWS BETWEEN UNBOUNDED PRECEDING AND 1 PRECEDING
        ) AS reached_ns
    FROM clipped
),
hole AS (
    SELECT
        host, count(*) AS holes,
        sum(greatest(end_ns - greatest(begin_ns, coalesce(reached_ns, begin_ns)), 0))
        / any_value(length_ns) AS share
    FROM reached
    GROUP BY host
),
pair AS (
    SELECT
        a.host, count(*) AS pairs,
        count(DISTINCT (p.host, p.pid, p.publisher_handle, a.subscription_id)) AS ways
    FROM truth_pair AS a
    JOIN simulated_publication AS p ON a.publication_id = p.publication_id
    GROUP BY a.host
)
SELECT
    sum(p.pairs)::BIGINT AS pairs,
    coalesce(ceil(sum(2 * (p.pairs * h.share + p.ways * h.holes))), 0)::BIGINT AS allowed
FROM pair AS p
LEFT JOIN hole AS h ON p.host = h.host;
