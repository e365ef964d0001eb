/* The same manager in C, without a library for JSON: cc -O2 -o manager manager.c */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char line[1 << 20];

static int is(const char *type) {
    char text[80];
    snprintf(text, sizeof text, "\"type\":\"%s\"", type);
    return strstr(line, text) != NULL;
}

int main(void) {
    int searches = 0, follows = 0, failed = 0;
    while (fgets(line, sizeof line, stdin)) {
        if (is("mission_started")) {
            searches = follows = failed = 0;
            printf("{\"protocol\":1,\"period_s\":2.0,\"subscribes_to\":[\"component_status\"],"
                   "\"depends_on\":{\"water_visibility\":[2.25,3.25]}}\n");
        } else if (is("task_requested") || is("task_cancelled")) {
            int begins = is("task_requested");
            if (strstr(line, "f_generate_search_path")) searches = begins;
            if (strstr(line, "f_follow_pipeline")) follows = begins;
            printf("{}\n");
        } else if (is("diagnostic")) {
            failed = strstr(line, "\"value\":\"FALSE\"") != NULL;
            printf("{}\n");
        } else if (is("adapt")) {
            const char *value = strstr(line, "\"water_visibility\":");
            double visibility = value ? atof(value + strlen("\"water_visibility\":")) : 0.0;
            printf("{\"modes\":{\"f_maintain_motion\":\"%s\"", failed ? "fd_recover_thrusters" : "fd_all_thrusters");
            if (searches)
                printf(",\"f_generate_search_path\":\"fd_spiral_%s\"",
                       visibility >= 3.25 ? "high" : visibility >= 2.25 ? "medium" : "low");
            if (follows) printf(",\"f_follow_pipeline\":\"fd_follow_pipeline\"");
            printf("}}\n");
        } else {
            printf("{}\n");
        }
        fflush(stdout);
    }
    return 0;
}
