-- name: staging.host
-- description: Machines and containers. Containers of one machine share its clock, not its name.
-- grain: one row per clock and hostname
-- when: staging.source
SELECT
    row_number() OVER (ORDER BY min(s.trace_index)) AS host_id,
    c.clock_id,
    s.hostname
FROM staging.placed_source AS s
JOIN staging.clock AS c ON s.clock_key = c.clock_key
GROUP BY c.clock_id, s.hostname
