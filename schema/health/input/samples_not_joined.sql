-- title: Samples of functions do not fit the ROS events
-- description: Nothing is said of these samples, since their times or processes have no match.
-- cause: perf recorded without -k CLOCK_MONOTONIC, on another machine, or no process of the
--     recording; or that runs in a container that gives it another pid.
-- cure: Record again with the clock of LTTng, inside the container (docs/functions.md). Give the
--     traces of a machine the name that it has in perf's file: --host NAME=PATH.
-- grain: one row per reason
-- severity: warning
-- when: staging.sample_text
SELECT
    count(*) AS count,
    printf('%d samples of functions have times of another clock, or no time', count(*)) AS detail
FROM staging.sample_text
WHERE NOT is_monotonic OR clock_key IS NOT NULL AND at_ns IS NULL
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf(
        '%d samples of functions are of a host of another name, and the traces have several clocks',
        count(*)
    )
FROM staging.sample_text
WHERE is_monotonic AND clock_key IS NULL
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf('none of %d samples of functions is of a process that recorded events', count(*))
FROM staging.sample_text
WHERE clock_key IS NOT NULL
HAVING count(*) > 0 AND (SELECT count(*) FROM staging.stack_sample) = 0
