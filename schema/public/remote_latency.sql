-- description: Messages between hosts of different clocks: how long they took, and how wrong that
--     can be. The bound contains the errors of both clocks.
-- grain: one row per message between two clocks
-- column: run_id
-- column: publication_id BIGINT  Where the message came from
-- column: take_id BIGINT  Where it was received
-- column: from_host_id BIGINT  Host that sent
-- column: to_host_id BIGINT  Host that received
-- column: latency_ns BIGINT [ns]  From the end of the publication to the take
-- column: uncertainty_ns BIGINT [ns]  Bound of the error of the latency; NULL: not known, as the
--     clocks were not brought together
WITH place AS (
    SELECT p.process_id, h.host_id, c.*
    FROM store.process AS p
    JOIN store.host AS h ON p.host_id = h.host_id
    JOIN store.clock AS c ON h.clock_id = c.clock_id
),
way AS (
    SELECT
        l.run_id, l.publication_id, l.take_id,
        b.end_ns AS sent_ns,
        t.taken_ns,
        f.host_id AS from_host_id,
        o.host_id AS to_host_id,
        f.clock_id AS from_clock_id,
        o.clock_id AS to_clock_id,
        derive.corrected_ns(t.taken_ns, o) - derive.corrected_ns(b.end_ns, f) AS latency_ns,
        f.reference_clock_id = o.reference_clock_id AS is_comparable,
        f.uncertainty_ns AS from_uncertainty_ns,
        o.uncertainty_ns AS to_uncertainty_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN place AS f ON b.process_id = f.process_id
    JOIN place AS o ON t.process_id = o.process_id
    WHERE f.clock_id <> o.clock_id
        -- Says at once that most runs have none.
        AND l.run_id IN (SELECT run_id FROM store.clock GROUP BY run_id HAVING count(*) > 1)
)
SELECT
    w.run_id, w.publication_id, w.take_id, w.from_host_id, w.to_host_id, w.latency_ns,
    CASE
        WHEN w.is_comparable THEN ceil(
            coalesce(f.uncertainty_ns + f.growth * (w.sent_ns - f.at_ns), w.from_uncertainty_ns)
            + coalesce(o.uncertainty_ns + o.growth * (w.taken_ns - o.at_ns), w.to_uncertainty_ns)
        )::BIGINT
    END AS uncertainty_ns
FROM way AS w
ASOF LEFT JOIN derive.clock_piece AS f ON w.from_clock_id = f.clock_id AND w.sent_ns >= f.from_ns
ASOF LEFT JOIN derive.clock_piece AS o ON w.to_clock_id = o.clock_id AND w.taken_ns >= o.from_ns
