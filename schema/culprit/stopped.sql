-- title: A timer, a topic or a subscription that stopped
-- description: It is silent from some moment until the end of the run, and no other change explains
--     that. Data at the end of the path are as old as the silence.
-- grain: one row per node and timer, topic or subscription
-- reads: application_path, change
-- next: query changes --node {node}
SELECT
    3 AS place,
    c.node,
    CASE c.what
        WHEN 'timer' THEN c.subject
        WHEN 'take' THEN printf('Subscription(%s)', c.subject)
    END
    AS callback,
    p.path,
    CASE WHEN c.what = 'timer' THEN p.steps[list_position(p.steps, c.node) + 1]
        ELSE c.subject END AS topic_name,
    -- Their age grows from 0 to the silence.
    (c.after * c.after / 2 / p.length_ns)::BIGINT AS harm_ns,
    c.count AS lost,
    c.at_ns - r.start_ns AS since_ns,
    coalesce(
        c.since,
        -- A timer of the time of a simulation ends with that, and what it publishes.
        (
            SELECT printf('/clock stopped at %.3f s', (any_value(k.at_ns) - r.start_ns) / 1e9)
            FROM change AS k
            WHERE k.kind = 'stop' AND k.subject = '/clock'
                AND k.at_ns BETWEEN c.at_ns AND c.at_ns + c.after / c.count
        )
    ) AS occasion,
    [c.node || c.subject] AS claims
FROM change AS c
JOIN main.run AS r ON c.run_id = r.run_id
JOIN application_path AS p
    ON list_contains(p.steps[:-2], CASE WHEN c.what = 'timer' THEN c.node ELSE c.subject END)
    OR (c.what <> 'timer' AND p.steps[-2] = c.subject)
WHERE c.kind = 'stop' AND c.follows IS NULL
QUALIFY row_number() OVER (
    PARTITION BY c.node, c.what, c.subject ORDER BY p.p95_ns DESC, p.path
) = 1
