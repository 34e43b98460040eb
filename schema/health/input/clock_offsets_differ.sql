-- title: Clock offsets of one boot differ
-- description: Traces of one boot count from different times. All were brought to the time of the
--     first that is not the kernel's.
-- cause: The clock of the host was set between the starts of two sessions.
-- cure: None needed.
-- grain: one row, if there are any
-- severity: info
-- when: staging.source WHERE clock_correction_ns <> 0
SELECT
    count(*) AS count,
    printf(
        'traces of one boot whose clock offset differs from the first one by %+.3f ms to %+.3f ms: '
        || 'brought to one time base',
        -max(clock_correction_ns) / 1e6, -min(clock_correction_ns) / 1e6
    ) AS detail
FROM staging.source
WHERE clock_correction_ns <> 0
HAVING count(*) > 0
