-- description: Containers of a host but the first one. Two sessions of the same threads are of one
--     container, and so are two that a third one joins. Sessions of other threads under the same
--     ids are of two containers: the later one is another than the first.
-- grain: one row per session of such a container, with the first session of the container
-- column: session BIGINT  The session
-- column: container BIGINT  First session of its container
-- when: temp.overlap_window
WITH RECURSIVE twin AS (
    SELECT
        left_session AS session,
        right_session AS other
    FROM session_pair
    WHERE is_same
    UNION ALL
    SELECT right_session, left_session
    FROM session_pair
    WHERE is_same
),
reached (session, member) AS (
    SELECT DISTINCT session, session
    FROM (SELECT unnest([left_session, right_session]) AS session FROM session_pair)
    UNION
    SELECT r.session, t.other
    FROM reached AS r
    JOIN twin AS t ON r.member = t.session
),
grouped AS (
    SELECT
        session,
        min(member) AS container
    FROM reached
    GROUP BY session
)
SELECT session, container
FROM grouped
WHERE container IN (
    SELECT greatest(l.container, r.container)
    FROM session_pair AS p
    JOIN grouped AS l ON p.left_session = l.session
    JOIN grouped AS r ON p.right_session = r.session
    WHERE l.container <> r.container
)
