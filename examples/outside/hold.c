/* Hold a mock-up where it is from outside: a program in C that needs nothing but zenoh-pico.
 *
 *     cc -std=c11 -DZENOH_LINUX -I zenoh-pico/include -I zenoh-pico/build/include hold.c -o hold \
 *         zenoh-pico/build/lib/libzenohpico.a -lpthread -lm
 *     ./hold tcp/127.0.0.1:7447 alpha anna 30
 *
 * It asks for the control lease, reads the state of the vehicle, and sends ten wrenches a second in body axes
 * for as many seconds as it is told to. If it is killed, the station brakes the vehicle and holds it. */

#define _DEFAULT_SOURCE /* usleep */
#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <zenoh-pico.h>

static const double MASS_KG = 11.0, INERTIA_KG_M2 = 0.25, STIFFNESS_1_S2 = 0.16, DAMPING_1_S = 0.8;
static const double TURN_RAD = 6.283185307179586;
enum { WRENCHES = 10, RENEWED_S = 10, MOST_BYTES = 512 };

typedef struct {
    double x_m, y_m, heading_rad, vx_m_s, vy_m_s, rate_rad_s;
} state_t;

static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
static state_t newest;
static int has_state, was_refused;

/* A state out of VEHICLE/state: CDR, little endian, six doubles behind a ROS 2 header with the vehicle's name. */
static void take_state(z_loaned_sample_t *sample, void *unused) {
    (void)unused;
    uint8_t bytes[MOST_BYTES];
    z_bytes_reader_t reader = z_bytes_get_reader(z_sample_payload(sample));
    size_t length = z_bytes_reader_read(&reader, bytes, sizeof bytes);
    uint32_t name;
    if (length < 16) return;
    memcpy(&name, bytes + 12, sizeof name);
    if (name > 255) return;
    size_t begin = 16 + name;
    begin += (8 - (begin - 4) % 8) % 8; /* doubles begin at multiples of 8 behind the first four bytes */
    if (length < begin + sizeof newest) return;
    pthread_mutex_lock(&lock);
    memcpy(&newest, bytes + begin, sizeof newest);
    has_state = 1;
    pthread_mutex_unlock(&lock);
}

static void take_answer(z_loaned_sample_t *sample, void *unused) {
    (void)unused;
    z_owned_string_t text;
    z_bytes_to_string(z_sample_payload(sample), &text);
    printf("%.*s\n", (int)z_string_len(z_loan(text)), z_string_data(z_loan(text)));
    fflush(stdout);
    char content[MOST_BYTES];
    snprintf(content, sizeof content, "%.*s", (int)z_string_len(z_loan(text)), z_string_data(z_loan(text)));
    if (strstr(content, "\"accepted\": false")) {
        pthread_mutex_lock(&lock);
        was_refused = 1;
        pthread_mutex_unlock(&lock);
    }
    z_drop(z_move(text));
}

static int subscribe(z_owned_session_t *session, z_owned_subscriber_t *made, const char *key,
                     void (*take)(z_loaned_sample_t *, void *)) {
    z_view_keyexpr_t expression;
    z_owned_closure_sample_t callback;
    z_closure(&callback, take, NULL, NULL);
    return z_view_keyexpr_from_str(&expression, key) < 0 ||
           z_declare_subscriber(z_loan(*session), made, z_loan(expression), z_move(callback), NULL) < 0;
}

static void put(z_owned_session_t *session, const char *key, const char *text) {
    z_view_keyexpr_t expression;
    z_owned_bytes_t payload;
    z_view_keyexpr_from_str(&expression, key);
    z_bytes_copy_from_str(&payload, text);
    z_put(z_loan(*session), z_loan(expression), z_move(payload), NULL);
}

int main(int count, char **words) {
    if (count != 5) {
        fprintf(stderr, "usage: %s ENDPOINT VEHICLE AUTHOR SECONDS\n", words[0]);
        return 2;
    }
    const char *vehicle = words[2], *author = words[3];
    char key[128], text[MOST_BYTES];
    z_owned_config_t config;
    z_owned_session_t session;
    z_owned_subscriber_t answers, states;
    z_config_default(&config);
    zp_config_insert(z_loan_mut(config), Z_CONFIG_MODE_KEY, "client");
    zp_config_insert(z_loan_mut(config), Z_CONFIG_CONNECT_KEY, words[1]);
    if (z_open(&session, z_move(config), NULL) < 0) {
        fprintf(stderr, "no station answers at %s\n", words[1]);
        return 1;
    }
    snprintf(key, sizeof key, "outside/%s/answer", vehicle);
    int is_wrong = subscribe(&session, &answers, key, take_answer);
    snprintf(key, sizeof key, "%s/state", vehicle);
    if (is_wrong || subscribe(&session, &states, key, take_state)) {
        fprintf(stderr, "%s is no name of a vehicle\n", vehicle);
        return 1;
    }
    state_t goal = {0}, now;
    int holds = 0, number = 0, refused = 0;
    for (int step = 0; step < WRENCHES * atoi(words[4]) && !refused; ++step) {
        if (step % (WRENCHES * RENEWED_S) == 0) { /* a short lease: it ends by itself where this program does */
            snprintf(key, sizeof key, "outside/%s/request", vehicle);
            snprintf(text, sizeof text,
                     "{\"author\": \"%s\", \"id\": %d, \"action\": \"take_control\", \"arguments\": {\"for_s\": 30}}",
                     author, ++number);
            put(&session, key, text);
        }
        usleep(1000000 / WRENCHES);
        pthread_mutex_lock(&lock);
        now = newest;
        refused = was_refused;
        if (has_state && !holds) {
            goal = now;
            holds = 1;
        }
        pthread_mutex_unlock(&lock);
        if (!holds) continue;
        double ax = STIFFNESS_1_S2 * (goal.x_m - now.x_m) - DAMPING_1_S * now.vx_m_s;
        double ay = STIFFNESS_1_S2 * (goal.y_m - now.y_m) - DAMPING_1_S * now.vy_m_s;
        double lean = remainder(goal.heading_rad - now.heading_rad, TURN_RAD);
        double cosine = cos(now.heading_rad), sine = sin(now.heading_rad);
        snprintf(key, sizeof key, "outside/%s/wrench", vehicle);
        snprintf(text, sizeof text,
                 "{\"author\": \"%s\", \"id\": %d, \"force_x_n\": %.6f, \"force_y_n\": %.6f, \"torque_nm\": %.6f}",
                 author, ++number, MASS_KG * (cosine * ax + sine * ay), MASS_KG * (cosine * ay - sine * ax),
                 INERTIA_KG_M2 * (STIFFNESS_1_S2 * lean - DAMPING_1_S * now.rate_rad_s));
        put(&session, key, text);
    }
    snprintf(key, sizeof key, "outside/%s/request", vehicle);
    snprintf(text, sizeof text, "{\"author\": \"%s\", \"id\": %d, \"action\": \"give_control\"}", author, ++number);
    put(&session, key, text);
    usleep(500000);
    z_drop(z_move(answers));
    z_drop(z_move(states));
    z_drop(z_move(session));
    return refused || !holds;
}
