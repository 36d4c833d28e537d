/* Files and libraries, as the system has them. */

#if !defined(_WIN32)
#define _GNU_SOURCE /* dladdr, mincore */
#endif

#include "container.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#if defined(_WIN32)
#include <windows.h>
#else
#include <dlfcn.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>
#endif

#if defined(_WIN32) && defined(_WIN64)
const char *const LIBRARY_FOLDERS[2][3] = {{"win64", 0, 0}, {"x86_64-windows", 0, 0}};
#elif defined(_WIN32)
const char *const LIBRARY_FOLDERS[2][3] = {{"win32", 0, 0}, {"x86-windows", 0, 0}};
#elif defined(__APPLE__) && defined(__aarch64__)
const char *const LIBRARY_FOLDERS[2][3] = {{"aarch64-darwin", "darwin64", 0}, {"aarch64-darwin", 0, 0}};
#elif defined(__APPLE__)
const char *const LIBRARY_FOLDERS[2][3] = {{"darwin64", "x86_64-darwin", 0}, {"x86_64-darwin", 0, 0}};
#elif defined(__aarch64__)
const char *const LIBRARY_FOLDERS[2][3] = {{"aarch64-linux", 0, 0}, {"aarch64-linux", 0, 0}};
#elif defined(__x86_64__)
const char *const LIBRARY_FOLDERS[2][3] = {{"linux64", "x86_64-linux", 0}, {"x86_64-linux", 0, 0}};
#else
const char *const LIBRARY_FOLDERS[2][3] = {{"linux32", 0, 0}, {"x86-linux", 0, 0}};
#endif

#if defined(_WIN32)
const char *const LIBRARY_SUFFIX = ".dll";
#elif defined(__APPLE__)
const char *const LIBRARY_SUFFIX = ".dylib";
#else
const char *const LIBRARY_SUFFIX = ".so";
#endif

char *joined(const char *folder, const char *rest) {
    const size_t length = strlen(folder);
    char *found = (char *)malloc(length + strlen(rest) + 2);
    if (!found) return 0;
    strcpy(found, folder);
    if (length && folder[length - 1] != '/' && folder[length - 1] != '\\') strcat(found, "/");
    return strcat(found, rest);
}

#if defined(_WIN32)

static wchar_t *wide(const char *text) {
    const int length = MultiByteToWideChar(CP_UTF8, 0, text, -1, 0, 0);
    wchar_t *found = length > 0 ? (wchar_t *)malloc((size_t)length * sizeof *found) : 0;
    if (found) MultiByteToWideChar(CP_UTF8, 0, text, -1, found, length);
    return found;
}

void *load_library(const char *path, char *why, size_t size) {
    wchar_t *name = wide(path);
    for (wchar_t *at = name; at && *at; at++)
        if (*at == L'/') *at = L'\\'; /* or what it needs is not looked for in its own folder */
    HMODULE found = name ? LoadLibraryExW(name, 0, LOAD_WITH_ALTERED_SEARCH_PATH) : 0;
    if (!found) snprintf(why, size, "error %lu of Windows", (unsigned long)GetLastError());
    free(name);
    return (void *)found;
}

Function find_function(void *library, const char *name) { return (Function)GetProcAddress((HMODULE)library, name); }

void unload_library(void *library) { FreeLibrary((HMODULE)library); }

int is_folder(const char *path) {
    wchar_t *name = wide(path);
    const DWORD found = name ? GetFileAttributesW(name) : INVALID_FILE_ATTRIBUTES;
    free(name);
    return found != INVALID_FILE_ATTRIBUTES && found & FILE_ATTRIBUTE_DIRECTORY;
}

void *open_file(const char *path) {
    wchar_t *name = wide(path);
    FILE *file = name ? _wfopen(name, L"rb") : 0;
    free(name);
    return file;
}

int is_readable(const void *address, size_t size) { return address && !IsBadReadPtr(address, size); }

/* The file that a function of this library is in. */
static char *own_file(const void *here) {
    HMODULE module = 0;
    wchar_t name[4096];
    if (!GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT, (LPCWSTR)here,
                            &module))
        return 0;
    if (!GetModuleFileNameW(module, name, 4096)) return 0;
    const int length = WideCharToMultiByte(CP_UTF8, 0, name, -1, 0, 0, 0, 0);
    char *found = length > 0 ? (char *)malloc((size_t)length) : 0;
    if (found) WideCharToMultiByte(CP_UTF8, 0, name, -1, found, length, 0, 0);
    return found;
}

#else

void *load_library(const char *path, char *why, size_t size) {
    void *found = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    const char *const words = found ? 0 : dlerror();
    if (!found) snprintf(why, size, "%s", words ? words : "no reason was given");
    return found;
}

Function find_function(void *library, const char *name) {
    void *const found = dlsym(library, name);
    Function function;
    memcpy(&function, &found, sizeof function);
    return function;
}

void unload_library(void *library) { dlclose(library); }

int is_folder(const char *path) {
    struct stat found;
    return stat(path, &found) == 0 && S_ISDIR(found.st_mode);
}

void *open_file(const char *path) { return fopen(path, "rb"); }

int is_readable(const void *address, size_t size) {
    const uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE), first = (uintptr_t)address & ~(page - 1);
    const uintptr_t last = ((uintptr_t)address + (size ? size - 1 : 0)) & ~(page - 1);
    if ((uintptr_t)address < page || last < first) return 0;
    for (uintptr_t at = first;; at += page) {
#if defined(__APPLE__)
        char in_memory;
#else
        unsigned char in_memory;
#endif
        if (mincore((void *)at, page, &in_memory)) return 0; /* nothing is mapped there */
        if (at == last) return 1;
    }
}

static char *own_file(const void *here) {
    Dl_info found;
    if (!dladdr(here, &found) || !found.dli_fname) return 0;
    if (found.dli_fname[0] != '/') return realpath(found.dli_fname, 0); /* it was loaded by a path from where the process is */
    char *copy = (char *)malloc(strlen(found.dli_fname) + 1);
    return copy ? strcpy(copy, found.dli_fname) : 0;
}

#endif

/* The path of a file: URL, in place; anything else is a path already. */
static void url_to_path(char *url) {
    const char *const scheme = "file:";
    for (int i = 0; i < 5; i++)
        if (tolower((unsigned char)url[i]) != scheme[i]) return;
    char *from = url + 5, *to = url;
    if (!strncmp(from, "//", 2)) {
        from += 2;
        char *const slash = strchr(from, '/'); /* after the host's name, which is empty or this one */
        if (slash) from = slash;
    }
    if (from[0] == '/' && isalpha((unsigned char)from[1]) && from[2] == ':') from++; /* /C:/... of Windows */
    while (*from) {
        unsigned code;
        if (*from == '%' && isxdigit((unsigned char)from[1]) && isxdigit((unsigned char)from[2]) && sscanf(from + 1, "%2x", &code) == 1) {
            *to++ = (char)code;
            from += 3;
        } else
            *to++ = *from++;
    }
    *to = 0;
}

static int has_system(const char *folder) {
    char *const path = joined(folder, "container/system.bin");
    FILE *const file = path ? (FILE *)open_file(path) : 0;
    free(path);
    if (file) fclose(file);
    return file != 0;
}

/* The resources beside the folder with this library: <FMU>/binaries/<platform>/<library> */
static char *beside(const void *here) {
    char *path = own_file(here);
    for (int i = 0; path && i < 3; i++) {
        char *slash = strrchr(path, '/'), *const other = strrchr(path, '\\');
        if (other > slash) slash = other;
        if (slash)
            *slash = 0;
        else {
            free(path);
            path = 0;
        }
    }
    char *const found = path ? joined(path, "resources") : 0;
    free(path);
    return found;
}

char *resource_folder(const char *location, int is_url, const void *here) {
    char *told = location ? joined(location, "") : 0;
    if (told && is_url) url_to_path(told);
    if (told && has_system(told)) return told;
    char *const own = beside(here); /* some hosts tell another folder, or none */
    if (own && has_system(own)) {
        free(told);
        return own;
    }
    free(own);
    return told;
}
