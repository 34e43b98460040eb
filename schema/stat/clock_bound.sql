-- name: derive.clock_bound
-- kind: macro
-- description: What messages say of how far two clocks are apart. A message cannot be received
--     before it was sent: one to the clock `clock_id` says what has to be added to its times at
--     least to get those of `other_clock_id`, one from it says what at most. The difference is
--     `-sense * bound_ns`, so that of both directions the largest `bound_ns` tells most. Only
--     messages matched by their stamps count, where there is no other candidate: that
--     needs no comparison of the two clocks.
-- grain: one row per pair of clocks and message between them
-- needs: store.link_transport, store.publication, store.take, store.process, store.host
CREATE OR REPLACE MACRO derive.clock_bound(of_run) AS TABLE
WITH process_clock AS MATERIALIZED (
    SELECT p.process_id, h.clock_id
    FROM store.process AS p
    JOIN store.host AS h ON p.host_id = h.host_id
    WHERE p.run_id = of_run
),
message AS (
    SELECT f.clock_id AS from_clock_id, o.clock_id AS to_clock_id, b.end_ns AS sent_ns, t.taken_ns
    FROM store.link_transport AS l
    JOIN store.publication AS b ON l.publication_id = b.publication_id
    JOIN store.take AS t ON l.take_id = t.take_id
    JOIN process_clock AS f ON b.process_id = f.process_id
    JOIN process_clock AS o ON t.process_id = o.process_id
    WHERE l.run_id = of_run
        AND l.method IN ('exact', 'nearest')
        AND l.candidate_count = 1
        AND f.clock_id <> o.clock_id
)
SELECT
    to_clock_id AS clock_id, from_clock_id AS other_clock_id, -1 AS sense, taken_ns AS at_ns,
    sent_ns - taken_ns AS bound_ns
FROM message
WHERE to_clock_id > from_clock_id
UNION ALL
SELECT from_clock_id, to_clock_id, 1, sent_ns, sent_ns - taken_ns
FROM message
WHERE from_clock_id > to_clock_id
