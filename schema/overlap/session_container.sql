-- name: overlap.session_container
-- kind: inline
-- description: Sessions whose threads are not those that an earlier session of their host recorded
--     under the same ids: they are of another container. Sessions of the same threads are of one.
-- grain: one row per such session, with the first session of its container
WITH other AS (
    SELECT DISTINCT right_session AS session FROM session_pair WHERE NOT is_same
),
grouped AS (
    SELECT o.session, coalesce(min(t.left_session), o.session) AS container
    FROM other AS o
    LEFT JOIN session_pair AS t ON o.session = t.right_session AND t.is_same
    GROUP BY o.session
)
SELECT session, container
FROM grouped
WHERE container IN (SELECT session FROM other)
