-- description: Whether times of two processes can be compared: they have one clock, or one of the
--     two clocks was brought to the other's time.
-- grain: one row per ordered pair of processes of a run
WITH timed AS (
    SELECT p.run_id, p.process_id, c.clock_id, c.method
    FROM store.process AS p
    JOIN store.host AS h ON p.host_id = h.host_id
    JOIN store.clock AS c ON h.clock_id = c.clock_id
)
SELECT
    a.run_id, a.process_id, b.process_id AS other_process_id,
    a.clock_id = b.clock_id OR a.method <> 'none' OR b.method <> 'none' AS is_comparable
FROM timed AS a
JOIN timed AS b ON a.run_id = b.run_id
