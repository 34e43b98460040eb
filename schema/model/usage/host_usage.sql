-- description: How busy hosts were between two looks at all of it. What the kernel does not show is
--     NULL, as is a counter that fell.
-- grain: one row per host and time between two samples of it
-- when: staging.usage_line
WITH value AS (
    SELECT
        file, at_ns, before_ns,
        split_part(line, chr(9), 2) AS name,
        split_part(line, chr(9), 3) AS text,
        -- No more digits than fit.
        regexp_extract_all(text, '\d{1,15}')::BIGINT[] AS numbers,
        staging.usage_number(regexp_extract(text, 'total=(\d+)', 1) || '000') AS pressure_ns
    FROM staging.usage_line
    WHERE kind = 'host'
),
sample AS (
    SELECT
        file, at_ns, before_ns,
        [
            -- Of users, nice ones, the kernel, and interrupts.
            any_value(list_sum([numbers[1], numbers[2], numbers[3], numbers[6], numbers[7]]))
                FILTER (WHERE name = 'cpu'),
            any_value(numbers[8]) FILTER (WHERE name = 'cpu'),
            any_value(pressure_ns) FILTER (WHERE name = 'cpu_pressure'),
            any_value(pressure_ns) FILTER (WHERE name = 'io_pressure'),
            any_value(pressure_ns) FILTER (WHERE name = 'memory_pressure'),
            any_value(list_sum(numbers)) FILTER (WHERE name = 'throttling')
        ] AS counts,
        any_value(list_avg(numbers)) FILTER (WHERE name = 'frequency') AS frequency,
        any_value(list_avg(numbers)) FILTER (WHERE name = 'most_frequency') AS most_frequency
    FROM value
    GROUP BY file, at_ns, before_ns
),
counted AS (
    SELECT
        file, at_ns, before_ns, frequency, most_frequency, counts,
        lag(counts) OVER (PARTITION BY file ORDER BY at_ns) AS earlier
    FROM sample
),
used AS (
    SELECT
        file, at_ns, before_ns, frequency, most_frequency,
        list_transform(
            counts,
            lambda count, place: CASE
                WHEN count >= earlier[place] THEN count - earlier[place]
            END
        ) AS counts
    FROM counted
    WHERE before_ns IS NOT NULL
)
SELECT
    f.host_id,
    u.before_ns AS start_ns,
    u.at_ns AS end_ns,
    f.cpus,
    try_cast(u.counts[1] * (1e9 / f.ticks) AS BIGINT) AS busy_ns,
    try_cast(u.counts[2] * (1e9 / f.ticks) AS BIGINT) AS stolen_ns,
    u.counts[3]::BIGINT AS cpu_pressure_ns,
    u.counts[4]::BIGINT AS io_pressure_ns,
    u.counts[5]::BIGINT AS memory_pressure_ns,
    (u.frequency * 1000)::BIGINT AS frequency_hz,
    (u.most_frequency * 1000)::BIGINT AS most_frequency_hz,
    try_cast(u.counts[6] AS BIGINT) AS throttle_count
FROM used AS u
JOIN staging.usage_file AS f ON u.file = f.file
ORDER BY f.host_id, u.at_ns
