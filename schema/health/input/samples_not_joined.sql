-- title: Samples of functions do not fit the ROS events
-- description: Nothing is said of these samples, since their times or processes have no match.
-- cause: perf recorded without -k CLOCK_MONOTONIC, on another machine, or no process of the
--     recording; or that runs in a container that gives it another pid. Or perf.script is the text
--     of plain perf script, without ids of processes.
-- cure: Record again with the clock of LTTng, inside the container (docs/functions.md). Give the
--     traces of a machine the name that it has in perf's file: --host NAME=PATH.
-- grain: one row per reason
-- severity: warning
-- when: staging.sample_text
WITH timed AS (
    SELECT
        at_ns + 60_000_000_000 < (SELECT min(start_ns) FROM staging.trace)
        OR at_ns - 60_000_000_000 > (SELECT max(end_ns) FROM staging.trace) AS is_outside
    FROM staging.sample_text
    WHERE is_of_time AND clock_key IS NOT NULL
)
SELECT
    count(*) AS count,
    printf('%d samples of functions have times of another clock, or no time', count(*)) AS detail
FROM staging.sample_text
WHERE is_of_time AND (NOT is_monotonic OR clock_key IS NOT NULL AND at_ns IS NULL)
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf(
        '%d samples or lines lack the id of their process or thread, or their time; perf script'
        || ' --header --ns -F pid,tid,cpu,time,event,period,ip,sym,dso > perf.script writes them',
        count(*)
    )
FROM staging.sample_text
WHERE is_of_time IS NULL
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf(
        'none of %d samples of functions is of a clock or of cycles: no other tells time', count(*)
    )
FROM staging.sample_text
WHERE is_of_time IS NOT NULL
HAVING count(*) > 0 AND NOT bool_or(is_of_time)
UNION ALL
SELECT
    count(*),
    printf(
        '%d samples of functions are of a host of another name, and the traces have several clocks',
        count(*)
    )
FROM staging.sample_text
WHERE is_of_time AND is_monotonic AND clock_key IS NULL
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf(
        '%d samples of functions are of times more than a minute outside of the recording: of '
        || 'another run, or another boot of the machine',
        count(*)
    )
FROM timed
WHERE is_outside
HAVING count(*) > 0
UNION ALL
SELECT
    count(*),
    printf('none of %d samples of functions is of a process that recorded events', count(*))
FROM timed
WHERE is_outside IS NOT TRUE
HAVING count(*) > 0 AND (SELECT count(*) FROM staging.stack_sample) = 0
