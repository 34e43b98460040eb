-- title: A topic that pauses while a callback of the process runs
-- description: A thread publishes on it outside of callbacks, or another callback does. The
--     callback that runs meanwhile may hold a lock, or the interpreter, or the thread itself.
-- grain: one row per publishing node and topic
-- reads: application_path, change, noticed
-- next: query loops --node {node}
SELECT
    9 AS place,
    c.node,
    p.path,
    c.subject AS topic_name,
    (c.count * c.after * c.after / 2 / p.length_ns)::BIGINT AS harm_ns,
    c.after::BIGINT AS run_ns,
    c.count,
    c.meanwhile_node AS other,
    c.meanwhile_callback AS other_callback,
    c.meanwhile_share AS share,
    [c.meanwhile_node || c.meanwhile_callback] AS claims
FROM change AS c
JOIN application_path AS p ON list_contains(p.steps, c.subject)
CROSS JOIN noticed AS l
WHERE c.kind = 'gap' AND c.what = 'topic' AND c.follows IS NULL
    AND c.meanwhile_node IS NOT NULL
    AND c.count >= l.lost
    AND harm_ns >= l.least_ns
QUALIFY row_number() OVER (PARTITION BY c.node, c.subject ORDER BY p.p95_ns DESC, p.path) = 1
