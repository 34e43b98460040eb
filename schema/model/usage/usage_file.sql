-- description: Files with samples of the system, each with the clock and the host that it is of
--     here. `hostname` is NULL where no trace has that name; without a clock, nothing of the file
--     counts.
-- grain: one row per file
-- when: raw.usage
WITH head AS (
    SELECT
        file,
        any_value(hostname) AS recorder,
        string_split(any_value(line) FILTER (WHERE number = 0), chr(9)) AS fields,
        count(*) FILTER (WHERE number > 0 AND line NOT LIKE 'look' || chr(9) || '%') AS lines
    FROM raw.usage
    GROUP BY file
)
SELECT
    f.file, f.recorder, f.lines, c.clock_id, b.origin_ns,
    b.known_hostname AS hostname,
    min(h.host_id) AS host_id,
    -- In how many parts of a second Linux counts CPU time.
    coalesce(nullif(staging.usage_number(f.fields[4]), 0), 100) AS ticks,
    greatest(try_cast(f.fields[5] AS SMALLINT), 1)::INTEGER AS cpus,
    -- Processes that record.
    string_split(f.fields[6], ' ') AS recorders
FROM head AS f
LEFT JOIN staging.clock_beside AS b
    ON f.recorder = b.hostname AND nullif(f.fields[3], '') IS NOT DISTINCT FROM b.boot_id
LEFT JOIN staging.clock AS c ON b.clock_key = c.clock_key
LEFT JOIN staging.host AS h
    ON c.clock_id = h.clock_id AND coalesce(b.known_hostname = h.hostname, true)
GROUP BY ALL
