-- description: Times in which two sessions recorded the same CPU.
-- grain: one row per pair of sessions and CPU
-- param: slack_ns BIGINT  Most time between the two records of one event
SELECT
    a.session AS left_session,
    b.session AS used_session,
    a.cpu_id,
    b.begin_ns - $slack_ns AS begin_ns,
    b.end_ns + $slack_ns AS end_ns
FROM coverage AS a
JOIN coverage AS b
    ON a.host = b.host
    AND a.session <> b.session
    AND a.cpu_id IS NOT DISTINCT FROM b.cpu_id
    AND a.begin_ns <= b.end_ns
    AND b.begin_ns <= a.end_ns
