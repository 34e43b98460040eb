-- title: Clocks that do not run evenly
-- description: No straight line fits the difference of two clocks, so that corrected times are off.
-- cause: A clock was set or slewed while recording, or its rate changed.
-- cure: Let the clocks settle before recording (chronyc waitsync). For this recording: look at
--     short stretches of it, or leave the clocks as recorded (msgflow clocks apply none).
-- grain: one row per pair of clocks
-- severity: warning
-- when: derive.clocks_to_synchronise
SELECT
    $run_id AS run_id,
    p.other_name || ' and ' || p.name AS subject,
    1 AS count,
    printf(
        'no straight line fits the clocks of %s and %s: corrected times are off by up to %.3f ms',
        p.other_name, p.name, p.uncertainty_ns / 1e6
    ) AS detail
FROM clock_compared AS p
WHERE NOT p.is_even
