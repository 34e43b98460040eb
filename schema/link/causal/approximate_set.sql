-- description: Sets of messages as message_filters (ApproximateTime) makes them, one for each
--     message that may be the pivot of a set: the latest of the first messages of the inputs that
--     are still unused. A set is the first message of every input from some moment on, up to the
--     pivot. The moment counts at which the set is narrowest; a later end counts a tenth more than
--     a later start, which is the age penalty of message_filters (0.1). The filter hands a set
--     over once no set with the same pivot can be better: then `proof_event_id`, the callback
--     instance of an input begins that showed it. It looks only when the input has come that it
--     waits for, the one with the oldest of the messages before the pivot. `is_close`: another set
--     is better if the stamps in the headers are older, as derive.approximate_message says, or the
--     stamps of an input are not in the order in which its messages came.
-- grain: one row per annotation, pivot of a set that was proven, and input
-- param: messages VARCHAR  Name of the rows of derive.approximate_message
CREATE OR REPLACE MACRO derive.approximate_set(only_run, messages) AS TABLE
WITH follower AS MATERIALIZED (
    SELECT
        annotation_id, subscription_id, callback_instance_id, start_ns, start_event_id, stamp_ns,
        age_ns,
        lead(stamp_ns) OVER by_stamp AS next_ns,
        lead(start_event_id) OVER by_stamp AS next_event_id,
        lead(age_ns) OVER by_stamp AS next_age_ns,
        lag(stamp_ns) OVER by_stamp AS previous_ns,
        stamp_ns < lag(stamp_ns) OVER by_arrival AS is_set_back
    FROM query_table(messages)
    WINDOW
        by_stamp AS (PARTITION BY annotation_id, subscription_id ORDER BY stamp_ns),
        by_arrival AS (PARTITION BY annotation_id, subscription_id ORDER BY start_event_id)
),
-- Of every input the last message up to the pivot, and the one after it.
around AS MATERIALIZED (
    SELECT
        p.annotation_id, p.pivot_id, p.pivot_ns, p.pivot_age_ns, p.subscription_id,
        l.stamp_ns AS last_ns,
        l.start_ns AS last_start_ns,
        l.start_event_id AS last_event_id,
        l.age_ns, l.next_ns, l.next_event_id, l.next_age_ns, l.is_set_back,
        -- Where it goes on after it waited for this input: those with older messages have come.
        CASE
            WHEN bool_and(l.next_event_id IS NOT NULL) OVER before THEN
                max(l.next_event_id) OVER before
        END AS resumed_event_id
    FROM (
        SELECT
            m.annotation_id,
            m.callback_instance_id AS pivot_id,
            m.stamp_ns AS pivot_ns,
            m.age_ns AS pivot_age_ns,
            i.subscription_id,
            count(*) OVER (PARTITION BY m.annotation_id, m.callback_instance_id) AS input_count
        FROM follower AS m
        JOIN store.annotation_input AS i ON m.annotation_id = i.annotation_id
    ) AS p
    ASOF JOIN follower AS l
        ON p.annotation_id = l.annotation_id
        AND p.subscription_id = l.subscription_id
        AND p.pivot_ns >= l.stamp_ns
    WINDOW before AS (
        PARTITION BY p.annotation_id, p.pivot_id ORDER BY l.stamp_ns ROWS UNBOUNDED PRECEDING
    )
    QUALIFY count(*) OVER (PARTITION BY p.annotation_id, p.pivot_id) = p.input_count
),
-- Moments that a set may start at: no later one has the same messages.
start AS (
    SELECT
        annotation_id, pivot_id, pivot_ns,
        last_ns AS start_ns
    FROM around
),
possible AS MATERIALIZED (
    SELECT
        s.annotation_id, s.pivot_id, s.start_ns,
        11 * max(CASE WHEN a.last_ns < s.start_ns THEN a.next_ns - s.pivot_ns ELSE 0 END)
        + 10 * (s.pivot_ns - s.start_ns) AS cost
    FROM start AS s
    JOIN around AS a ON s.annotation_id = a.annotation_id AND s.pivot_id = a.pivot_id
    GROUP BY s.annotation_id, s.pivot_id, s.pivot_ns, s.start_ns
    HAVING bool_and(a.last_ns >= s.start_ns OR a.next_ns IS NOT NULL)
),
narrowest AS MATERIALIZED (
    SELECT
        annotation_id, pivot_id,
        arg_min(possible.start_ns, (possible.cost, possible.start_ns)) AS start_ns,
        min(possible.cost) AS cost
    FROM possible
    GROUP BY annotation_id, pivot_id
),
member AS MATERIALIZED (
    SELECT
        n.annotation_id, n.pivot_id, n.start_ns, n.cost, n.subscription_id, m.callback_instance_id,
        m.stamp_ns, m.start_event_id, m.age_ns, m.previous_ns, m.next_ns
    FROM (
        SELECT n.annotation_id, n.pivot_id, n.start_ns, n.cost, i.subscription_id
        FROM narrowest AS n
        JOIN store.annotation_input AS i ON n.annotation_id = i.annotation_id
    ) AS n
    ASOF JOIN follower AS m
        ON n.annotation_id = m.annotation_id
        AND n.subscription_id = m.subscription_id
        AND n.start_ns <= m.stamp_ns
),
-- No set is better as soon as one of the messages that it would need makes it too wide: those of
-- sets that start earlier have come.
excluded AS (
    SELECT
        s.annotation_id, s.pivot_id,
        min(
            CASE
                WHEN 11 * (a.next_ns - s.pivot_ns) + 10 * (s.pivot_ns - s.start_ns) >= n.cost
                    THEN a.next_event_id
            END
        ) AS event_id
    FROM start AS s
    JOIN narrowest AS n ON s.annotation_id = n.annotation_id AND s.pivot_id = n.pivot_id
    JOIN around AS a
        ON s.annotation_id = a.annotation_id AND s.pivot_id = a.pivot_id AND a.last_ns < s.start_ns
    GROUP BY s.annotation_id, s.pivot_id, s.start_ns
),
known AS (
    SELECT
        annotation_id, pivot_id,
        max(event_id) AS event_id
    FROM (
        SELECT
            annotation_id, pivot_id,
            start_event_id AS event_id
        FROM member
        UNION ALL
        SELECT annotation_id, pivot_id, event_id
        FROM excluded
    )
    GROUP BY annotation_id, pivot_id
    HAVING count(*) = count(event_id)
),
proven AS (
    SELECT
        a.annotation_id, a.pivot_id, a.pivot_ns,
        min(a.last_start_ns) AS since_ns,
        CASE
            WHEN k.event_id <= max(a.last_event_id) THEN k.event_id
            ELSE min(CASE WHEN a.resumed_event_id >= k.event_id THEN a.resumed_event_id END)
        END AS proof_event_id
    FROM around AS a
    JOIN known AS k ON a.annotation_id = k.annotation_id AND a.pivot_id = k.pivot_id
    GROUP BY a.annotation_id, a.pivot_id, a.pivot_ns, k.event_id
),
-- Each end (a message after the pivot, or the pivot) and each start may be older.
doubt AS MATERIALIZED (
    SELECT
        annotation_id, pivot_id, pivot_ns,
        CASE
            WHEN count(*) + count(next_ns) = count(age_ns) + count(next_age_ns)
                THEN 11 * greatest(max(next_age_ns), max(pivot_age_ns)) + 10 * max(age_ns)
        END AS cost
    FROM around
    GROUP BY annotation_id, pivot_id, pivot_ns
),
close AS (
    SELECT p.annotation_id, p.pivot_id
    FROM possible AS p
    JOIN narrowest AS n
        ON p.annotation_id = n.annotation_id
        AND p.pivot_id = n.pivot_id
        AND p.start_ns <> n.start_ns
    JOIN doubt AS d ON p.annotation_id = d.annotation_id AND p.pivot_id = d.pivot_id
    WHERE coalesce(p.cost - n.cost <= d.cost, true)
    UNION
    -- A message near the start may be on the other side of it: the next one, or the one before, is
    -- in the set.
    SELECT m.annotation_id, m.pivot_id
    FROM member AS m
    JOIN member AS s
        ON m.annotation_id = s.annotation_id AND m.pivot_id = s.pivot_id
        AND m.start_ns = s.stamp_ns AND m.subscription_id <> s.subscription_id
    JOIN doubt AS d ON m.annotation_id = d.annotation_id AND m.pivot_id = d.pivot_id
    WHERE coalesce(m.stamp_ns - m.age_ns <= m.start_ns, true)
        AND coalesce(
            11 * (m.next_ns - d.pivot_ns) + 10 * (d.pivot_ns - m.start_ns) - m.cost <= d.cost,
            m.next_ns IS NOT NULL
        )
        OR coalesce(m.previous_ns >= m.start_ns - s.age_ns, m.previous_ns IS NOT NULL)
    UNION
    -- The clock of the stamps was set back: the filter has its messages in another order.
    SELECT annotation_id, pivot_id FROM around WHERE is_set_back OR next_event_id < last_event_id
)
SELECT
    m.annotation_id, m.pivot_id, p.pivot_ns, p.proof_event_id, p.since_ns,
    c.pivot_id IS NOT NULL AS is_close,
    m.subscription_id, m.callback_instance_id, m.stamp_ns
FROM proven AS p
JOIN member AS m ON p.annotation_id = m.annotation_id AND p.pivot_id = m.pivot_id
LEFT JOIN close AS c ON p.annotation_id = c.annotation_id AND p.pivot_id = c.pivot_id
WHERE p.proof_event_id IS NOT NULL
