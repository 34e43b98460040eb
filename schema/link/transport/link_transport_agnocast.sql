-- description: Messages through the shared memory of Agnocast, by their number, which counts on one
--     topic of one kernel, that is of one clock. It needs no order: the event of a publication may
--     come behind that of a take. When the last user of a topic ends, its numbers begin again. A
--     publisher that was made after another had published shows that: the least of its numbers is
--     not greater. A publication and a take with such a moment between them are of different
--     messages. Where several have one number all the same (containers that share a clock, but no
--     memory), the one that is nearest in time is chosen.
-- grain: one row per take of Agnocast whose publication is known
-- when: store.agnocast_entry
CREATE OR REPLACE MACRO derive.link_transport_agnocast(only_run) AS TABLE
WITH published AS (
    SELECT
        e.entry_id, b.publication_id, b.publisher_id,
        b.end_ns AS at_ns,
        p.topic_name, p.created_ns, h.clock_id
    FROM store.agnocast_entry AS e
    JOIN store.publication AS b ON e.publication_id = b.publication_id
    JOIN store.publisher AS p ON b.publisher_id = p.publisher_id
    JOIN store.process AS o ON b.process_id = o.process_id
    JOIN store.host AS h ON o.host_id = h.host_id
    WHERE e.run_id = only_run
),
received AS (
    SELECT
        e.entry_id, t.take_id, t.subscription_id,
        t.taken_ns AS at_ns,
        s.topic_name, h.clock_id
    FROM store.agnocast_entry AS e
    JOIN store.take AS t ON e.take_id = t.take_id
    JOIN store.subscription AS s ON t.subscription_id = s.subscription_id
    JOIN store.process AS o ON t.process_id = o.process_id
    JOIN store.host AS h ON o.host_id = h.host_id
    WHERE e.run_id = only_run
),
-- Publishers whose creation was not traced tell nothing.
least AS (
    SELECT
        clock_id, topic_name,
        min(entry_id) AS entry_id,
        any_value(created_ns) AS created_ns
    FROM published
    WHERE created_ns IS NOT NULL
    GROUP BY clock_id, topic_name, publisher_id
),
beginning AS (
    SELECT
        l.clock_id, l.topic_name,
        l.created_ns AS at_ns
    FROM least AS l
    ASOF JOIN published AS p
        ON l.clock_id = p.clock_id AND l.topic_name = p.topic_name AND l.created_ns > p.at_ns
    WHERE l.entry_id <= p.entry_id
),
sent AS (
    SELECT
        p.entry_id, p.publication_id, p.publisher_id, p.at_ns, p.topic_name, p.clock_id,
        coalesce(b.at_ns, 0) AS begun_ns
    FROM published AS p
    ASOF LEFT JOIN beginning AS b
        ON p.clock_id = b.clock_id AND p.topic_name = b.topic_name AND p.at_ns >= b.at_ns
),
taken AS (
    SELECT
        t.entry_id, t.take_id, t.subscription_id, t.at_ns, t.topic_name, t.clock_id,
        coalesce(b.at_ns, 0) AS begun_ns
    FROM received AS t
    ASOF LEFT JOIN beginning AS b
        ON t.clock_id = b.clock_id AND t.topic_name = b.topic_name AND t.at_ns >= b.at_ns
),
moment AS (
    SELECT
        clock_id, topic_name, entry_id, begun_ns, at_ns,
        min(publication_id) AS publication_id,
        arg_min(publisher_id, publication_id) AS publisher_id,
        sum(count(*)) OVER (PARTITION BY clock_id, topic_name, entry_id, begun_ns) AS number
    FROM sent
    GROUP BY clock_id, topic_name, entry_id, begun_ns, at_ns
),
-- The nearest before and the nearest after: a damaged trace may have one number for all.
candidate AS (
    SELECT
        t.take_id, t.subscription_id, p.publication_id, p.publisher_id, p.number,
        t.at_ns - p.at_ns AS distance_ns
    FROM taken AS t
    ASOF JOIN moment AS p
        ON t.clock_id = p.clock_id
        AND t.topic_name = p.topic_name
        AND t.entry_id = p.entry_id
        AND t.begun_ns = p.begun_ns
        AND t.at_ns >= p.at_ns
    UNION ALL
    SELECT
        t.take_id, t.subscription_id, p.publication_id, p.publisher_id, p.number,
        p.at_ns - t.at_ns
    FROM taken AS t
    ASOF JOIN moment AS p
        ON t.clock_id = p.clock_id
        AND t.topic_name = p.topic_name
        AND t.entry_id = p.entry_id
        AND t.begun_ns = p.begun_ns
        AND t.at_ns < p.at_ns
)
SELECT
    only_run::BIGINT AS run_id,
    publication_id, take_id, publisher_id, subscription_id,
    'agnocast' AS method,
    number::BIGINT AS candidate_count,
    false AS is_loss_affected
FROM candidate
QUALIFY row_number() OVER (PARTITION BY take_id ORDER BY distance_ns, publication_id) = 1
